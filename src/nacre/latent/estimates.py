"""Materials known with some uncertainty: what to expect, and what is as plausible."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Doubles
from nacre.brdf import Brdf
from nacre.errors import FormatError, NacreError
from nacre.latent.basis import CodedBrdf, LatentBasis
from nacre.latent.file import pretrained_basis
from nacre.latent.intervals import FRACTION, interval, reflectance_interval
from nacre.latent.posterior import UNEXPLAINED, Posterior
from nacre.measured.scattered import ScatteredBrdf
from nacre.neural import NeuralBrdf, ensemble
from nacre.numerics.direction_samples import Scattered
from nacre.runtime.progress import Progress
from nacre.sampling.lit_views import lit_views

FEW = 200
"""Samples up to which a material is better known by what other materials are like."""
COUNT = 64
"""Plausible materials that are kept."""
ENOUGH = 16
"""Plausible materials that tell an interval where each takes long to evaluate."""
OBSERVED = "samples", "pixels", "readings"
"""What a material may be known from."""

_KEY = "plausible"
_STORED = np.dtype("<f2")


@dataclass(frozen=True)
class Estimate:
    """What few samples, or photographs, tell about a material."""

    material: CodedBrdf  # the expected one
    codes: npt.NDArray[np.float16]  # equally plausible, in the material's basis, shape (COUNT, k)
    count: int  # of samples, pixels or readings
    scale: tuple[float, float] | None = None  # see Posterior.scale
    observed: str = "samples"  # one of OBSERVED

    def kept_by(self, fitted: NeuralBrdf) -> NeuralBrdf:
        """A network that was fitted to the material, with the plausible ones in its metadata."""
        kept: dict[str, Any] = {
            "basis": self.material.basis.fingerprint(),
            self.observed: self.count,
            "codes": base64.b64encode(self.codes.astype(_STORED).tobytes()).decode("ascii"),
        }
        if self.scale is not None:
            kept["scale"] = self.scale[0]
        return fitted.replaced(metadata={**fitted.metadata, _KEY: kept})

    def facts(self) -> dict[str, Any]:
        """See :func:`facts`."""
        basis, scale = self.material.basis, self.scale and self.scale[0]
        others = [basis.decode(code) for code in self.codes]
        return _facts(others, {self.observed: self.count}, scale)


def is_few(brdf: Brdf) -> bool:
    """Whether a material is isotropic and known from :data:`FEW` samples or fewer."""
    return isinstance(brdf, ScatteredBrdf) and brdf.isotropic and len(brdf.samples) <= FEW


def estimate(
    brdf: ScatteredBrdf,
    basis: LatentBasis | None = None,
    *,
    free_scale: bool = False,
) -> Estimate:
    """A material from few samples.

    `brdf` is isotropic, `basis` that of the materials it may be like, the included one where None;
    for `free_scale` see :meth:`LatentBasis.posterior`. Raises NacreError if the basis takes no
    samples.
    """
    basis = basis or pretrained_basis()
    found = basis.posterior(brdf.scattered().samples, free_scale=free_scale)
    material = basis.decode(found.code, brdf.name).replaced(
        source=brdf.source, channels=brdf.channels, notes=brdf.notes
    )
    return Estimate(material, plausible_codes(found), len(brdf.samples), found.scale)


def plausible_codes(found: Posterior) -> npt.NDArray[np.float16]:
    """Equally plausible codes, shape (:data:`COUNT`, k)."""
    return found.draw(COUNT).astype(_STORED)


def kept_networks(fitted: NeuralBrdf, scan: Scattered, progress: Progress) -> NeuralBrdf:
    """A network that was fitted to a scan, with those that its noise leaves as plausible.

    Raises NacreError as :func:`nacre.neural.ensemble.plausible`.
    """
    others = ensemble.plausible(fitted, scan, progress)
    kept = {
        "samples": len(scan.samples),
        "networks": ensemble.stored(fitted, others),
    }
    return fitted.replaced(metadata={**fitted.metadata, _KEY: kept})


def _unexplained(material: Brdf) -> float:
    """Standard deviation of ln f_r that none of the :func:`plausible` materials explains."""
    kept = material.metadata.get(_KEY, {}) if isinstance(material, NeuralBrdf) else {}
    return 0.0 if "networks" in kept else UNEXPLAINED


def plausible(material: Brdf, basis: LatentBasis | None = None) -> list[Brdf]:
    """Materials that are as plausible as a network that was fitted to few samples, or to a scan
    with intervals; none for any other material.

    `basis` is the one that the estimate was made in, the included one where None. Raises
    FormatError if it was another basis, or what is kept is damaged.
    """
    if not isinstance(material, NeuralBrdf) or _KEY not in material.metadata:
        return []
    kept = material.metadata[_KEY]
    name = material.name or "network"
    if "networks" in kept:
        try:
            return list(ensemble.restored(material, kept["networks"]))
        except (TypeError, ValueError) as error:
            raise FormatError(f"{name}: plausible materials: cannot be read: {error}") from error
    basis = basis or pretrained_basis()
    try:
        stored = np.frombuffer(base64.b64decode(kept["codes"], validate=True), _STORED)
        codes = stored.reshape(-1, basis.code_dim).astype(np.float64)
        fingerprint = kept["basis"]
    except (LookupError, TypeError, ValueError) as error:
        raise FormatError(f"{name}: plausible materials: cannot be read: {error}") from error
    if fingerprint != basis.fingerprint():
        raise FormatError(f"{name}: plausible materials: belong to another basis")
    try:
        return [basis.decode(code, material.name) for code in codes]
    except ValueError as error:
        raise FormatError(f"{name}: plausible materials: {error}") from error


def bounds(
    material: Brdf, wi: npt.ArrayLike, wo: npt.ArrayLike, fraction: float = FRACTION
) -> tuple[Doubles, Doubles]:
    """Ends of f_r in 1/sr between which the truth should lie with a frequency of `fraction`.

    For a network that was fitted to few samples, or to a scan with intervals; shapes (..., 3),
    linear RGB, for directions (..., 3) that broadcast. Raises NacreError for any other material.
    """
    others = plausible(material)
    if not others:
        name = material.name or "this material"
        raise NacreError(f"{name}: nothing says how well it is known; fit a scan with intervals")
    return reflectance_interval(others, wi, wo, fraction, _unexplained(material))


def albedo_interval(materials: Sequence[Brdf]) -> tuple[Doubles, Doubles]:
    """Ends (3,) of the 90 % interval of the albedo for light along the normal, linear RGB."""
    return interval([material.albedo() for material in materials])


def facts(material: Brdf) -> dict[str, Any]:
    """How well a material is known; empty if it was not fitted to few samples."""
    others = plausible(material)
    if not others:
        return {}
    assert isinstance(material, NeuralBrdf)
    kept = material.metadata[_KEY]
    counts = {name: kept[name] for name in OBSERVED if name in kept}
    return _facts(others, counts, kept.get("scale"), _unexplained(material))


def in_words(known: Mapping[str, Any]) -> str:
    """The end of a line about a material, from its :func:`facts`; may be empty."""
    if not known:
        return ""
    low, high = (np.mean(known[f"plausible albedo {end}"]) for end in ("from", "to"))
    counts = (f"{known[f'known from {n}']} {n}" for n in OBSERVED if f"known from {n}" in known)
    text = f"; from {', '.join(counts)}: albedo {low:.3f} to {high:.3f} (90 %)"
    return f"{text}, f_r within a factor of {known['f_r known within a factor']:.2f}"


def _facts(
    others: Sequence[Brdf],
    counts: Mapping[str, int],
    scale: float | None,
    unexplained: float = UNEXPLAINED,
) -> dict[str, Any]:
    lit = lit_views(0, directions=16)
    pairs = lit.wi.reshape(-1, 3), lit.wo.reshape(-1, 3)
    low, high = reflectance_interval(others, *pairs, unexplained=unexplained)
    seen = low > 0.0
    darkest, brightest = albedo_interval(others)
    found: dict[str, Any] = {f"known from {name}": count for name, count in counts.items()}
    found |= {
        "factor of the instrument": scale,
        "plausible albedo from": [float(x) for x in darkest],
        "plausible albedo to": [float(x) for x in brightest],
        "f_r known within a factor": float(np.median(np.sqrt(high[seen] / low[seen]))),
    }
    return {name: value for name, value in found.items() if value is not None}
