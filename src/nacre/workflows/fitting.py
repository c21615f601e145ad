"""What is fitted to each material, and the files for it."""

from __future__ import annotations

import abc
import hashlib
import json
import math
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

from nacre import analytic, neural
from nacre.analytic import AnalyticBrdf
from nacre.analytic import file as analytic_file
from nacre.brdf import Brdf
from nacre.errors import FormatError, NacreError
from nacre.formats import check_target, identify, save, target
from nacre.io.files import PathLike
from nacre.latent import estimates
from nacre.measured.scattered import ScatteredBrdf
from nacre.neural import NeuralBrdf, Recipe, SpectralBrdf
from nacre.neural import file as neural_file
from nacre.neural.inputs import PAPER
from nacre.neural.published import KERAS, PAPER_ONLY
from nacre.numerics.mlp import RELU
from nacre.runtime.code_fingerprint import code_fingerprint, place_of
from nacre.runtime.progress import Progress

_ENCODERS: dict[str, Callable[[Any], bytes]] = {
    ".safetensors": neural_file.encode,
    ".json": analytic_file.encode,
}
"""Encoders of formats whose content can be made without a file."""


SPECTRAL = "spectral"
"""The name of spectral networks among models."""


class Fitting(abc.ABC):
    """A kind of fit to a measured material, and the kind of file it is written to."""

    holds: ClassVar[str]
    """What such files hold: "neural" or "analytic"."""
    ending: str
    """Ending of the written files, with the dot."""

    @property
    @abc.abstractmethod
    def settings(self) -> Mapping[str, Any]:
        """Everything that determines the fit to a material, as values for JSON."""

    @abc.abstractmethod
    def fit(self, brdf: Brdf, progress: Progress) -> Brdf:
        """The fit to a reflectance; raises a NacreError if it cannot be fitted."""

    def encode(self, fitted: Any) -> bytes:
        """The content of the file for a fit; raises a NacreError if it cannot be written."""
        if encode := _ENCODERS.get(self.ending):
            return encode(fitted)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"fit{self.ending}"
            save(fitted, path)
            return path.read_bytes()

    @abc.abstractmethod
    def losses(self, fitted: Any) -> dict[str, float]:
        """Losses of a fit by name."""

    @abc.abstractmethod
    def summary(self, fitted: Any) -> str:
        """A fit in one line."""

    def check(self) -> None:
        """Raise a NacreError if this machine cannot make such fits, or write them to such files."""
        name = f"*{self.ending}"
        entry = target(name)
        if entry.holds not in ("", self.holds):
            raise FormatError(f"{name}: {entry.name} files do not hold {self.holds} materials")

    @property
    def deciding(self) -> tuple[Any, ...]:
        """Functions and classes whose code determines the fit to a material."""
        return (type(self),)

    def code(self, path: PathLike | None = None) -> str | None:
        """Fingerprint of the reader, fit and writer for a file, or for files of any format.

        None if the format is unknown, or some of the code has no source, as in an interactive
        session.
        """
        try:
            reader = "nacre.formats:FORMATS" if path is None else place_of(_reader(path))
            writer = _ENCODERS.get(self.ending) or target(f"*{self.ending}").save
            places = {reader, *map(place_of, (*self.deciding, writer))}
            return code_fingerprint(*sorted(places))
        except (NacreError, ValueError, OSError, SyntaxError):  # the source is being edited
            return None

    @property
    def digest(self) -> str:
        """SHA-256 of the settings, in hexadecimal."""
        text = json.dumps({"ending": self.ending, **self.settings}, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


@dataclass(frozen=True)
class NetworkFitting(Fitting):
    """Fits of networks.

    Parameters
    ----------
    recipe
        Settings of :func:`nacre.fit`; if they leave the inputs open, `.h5` files get the paper's.
    device
        None for the compiled CPU kernel, or a PyTorch device.
    ending
        `.safetensors`, or `.h5`, the format of the paper's authors.
    prior
        Use what other materials are like for few samples; see :mod:`nacre.latent.estimates`.
    free_scale
        Also find one factor that scales all of few samples.
    intervals
        Also keep networks that the noise of a scan leaves as plausible; see
        :mod:`nacre.neural.ensemble`.
    """

    holds: ClassVar[str] = "neural"
    recipe: Recipe = field(default_factory=Recipe)
    device: str | None = None
    ending: str = ".safetensors"
    prior: bool = True
    free_scale: bool = False
    intervals: bool = False

    def __post_init__(self) -> None:
        if self._keras and self.recipe.inputs is None and not self.recipe.physical:
            object.__setattr__(self, "recipe", replace(self.recipe, inputs=PAPER))

    @property
    def settings(self) -> Mapping[str, Any]:
        few = {"prior": self.prior, "free_scale": self.free_scale, "intervals": self.intervals}
        few = {name: value for name, value in few.items() if value != (name == "prior")}
        return {"model": "nbrdf", "device": self.device, **asdict(self.recipe), **few}

    @property
    def deciding(self) -> tuple[Any, ...]:
        return neural.fit, neural.fit_many, estimates.estimate

    def fit(self, brdf: Brdf, progress: Progress) -> NeuralBrdf | SpectralBrdf:
        check_target(f"{brdf.name or 'fit'}{self.ending}", brdf)
        few = self.estimate(brdf)
        seen = few.material if few else brdf
        fitted = neural.fit(seen, self.recipe, device=self.device, progress=progress)
        if few:
            return few.kept_by(fitted)
        return self._with_intervals(brdf, fitted, progress) if self.intervals else fitted

    def _with_intervals(self, brdf: Brdf, fitted: NeuralBrdf, progress: Progress) -> NeuralBrdf:
        scan = brdf.scattered()
        if scan is None:
            name = brdf.name or "this material"
            raise NacreError(f"{name}: intervals are for scans with uncertainties; leave them out")
        return estimates.kept_networks(fitted, scan, progress)

    def estimate(self, brdf: Brdf) -> estimates.Estimate | None:
        """What to fit instead of a material known from few samples; else None."""
        if not self.prior or not isinstance(brdf, ScatteredBrdf) or not estimates.is_few(brdf):
            return None
        return estimates.estimate(brdf, free_scale=self.free_scale)

    def losses(self, fitted: Any) -> dict[str, float]:
        return _finite(fitted.metadata["quality"])

    def summary(self, fitted: Any) -> str:
        memory = f"{fitted.weight_count} weights of {fitted.nbytes:,} bytes"
        known = estimates.in_words(estimates.facts(fitted))
        return f"{memory}, {fitted.loss_text()}{_validation(fitted.metadata['quality'])}{known}"

    def check(self) -> None:
        """See :class:`Fitting`; also raises if PyTorch or the device is missing."""
        super().check()
        found = self.recipe.chosen_inputs, self.recipe.hidden_activation
        if self._keras and found != (PAPER, RELU):
            raise NacreError(f"*{self.ending}: {PAPER_ONLY}")
        if self.device is not None:
            from nacre.runtime.device import open_device

            open_device(self.device)

    @property
    def _keras(self) -> bool:
        return self.ending.lower() in KERAS.extensions


@dataclass(frozen=True)
class SpectralFitting(NetworkFitting):
    """Fits of spectral networks, which have neither a device nor a prior."""

    prior: bool = False

    @property
    def settings(self) -> Mapping[str, Any]:
        return {"model": SPECTRAL, **asdict(self.recipe)}

    @property
    def deciding(self) -> tuple[Any, ...]:
        return (neural.fit_spectral,)

    def fit(self, brdf: Brdf, progress: Progress) -> SpectralBrdf:
        check_target(f"{brdf.name or 'fit'}{self.ending}", brdf)
        return neural.fit_spectral(brdf, self.recipe, progress=progress)

    def check(self) -> None:
        """See :class:`Fitting`; also raises if a device is named, or the file holds RGB."""
        if self._keras:
            raise NacreError(f"*{self.ending}: holds RGB networks only; write a .safetensors file")
        super().check()
        if self.device is not None or self.free_scale or self.intervals:
            raise NacreError(
                "spectral networks are fitted on the CPU, without a prior and without intervals"
            )


@dataclass(frozen=True)
class AnalyticFitting(Fitting):
    """Fits of an analytic model, with keywords of :func:`nacre.analytic.fit` as options."""

    holds: ClassVar[str] = "analytic"
    model: type[AnalyticBrdf]
    options: Mapping[str, Any] = field(default_factory=dict)
    ending: str = ".json"

    @property
    def settings(self) -> Mapping[str, Any]:
        return {"model": self.model.model, **self.options}

    @property
    def deciding(self) -> tuple[Any, ...]:
        return analytic.fit, self.model

    def check(self) -> None:
        """See :class:`Fitting`; also raises if the files hold another model."""
        super().check()
        held = target(f"*{self.ending}").model
        if held and self.model.model not in (held, f"{held}-anisotropic"):
            raise FormatError(f"*{self.ending}: files hold {held} materials; add --model {held}")

    def fit(self, brdf: Brdf, progress: Progress) -> AnalyticBrdf:
        check_target(f"{brdf.name or 'fit'}{self.ending}", brdf)
        return analytic.fit(brdf, self.model, progress=progress, **self.options)

    def losses(self, fitted: Any) -> dict[str, float]:
        return _finite({"loss": fitted.metadata["fit"]["loss"]})

    def summary(self, fitted: Any) -> str:
        return f"{fitted.summary()}, {fitted.loss_text()}"


def _reader(path: PathLike) -> Callable[..., Brdf]:
    entry = identify(path)
    return entry.load_material or entry.load


def _finite(values: Mapping[str, float]) -> dict[str, float]:
    return {name: float(value) for name, value in values.items() if math.isfinite(value)}


def _validation(quality: Mapping[str, Any]) -> str:
    """Errors at the held-out samples of a scan; empty for other materials."""
    if "held_out_samples" not in quality:
        return ""
    errors = (
        f"median {100 * quality[f'{who}_median_error']:.1f} %, "
        f"mean {100 * quality[f'{who}_mean_error']:.1f} %"
        for who in ("held_out", "nearest_sample")
    )
    return (
        f", relative error at {quality['held_out_samples']} held-out samples: {next(errors)} "
        f"(of the nearest sample: {next(errors)})"
    )
