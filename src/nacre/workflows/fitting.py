"""What is fitted to each material of a library."""

from __future__ import annotations

import abc
import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, ClassVar

from nacre import analytic, neural
from nacre.analytic import AnalyticBrdf
from nacre.analytic import file as analytic_file
from nacre.brdf import Brdf
from nacre.neural import NeuralBrdf, Recipe
from nacre.neural import file as neural_file
from nacre.runtime.progress import Progress


class Fitting(abc.ABC):
    """A way to make of a measured material one that is written to a file of its own."""

    ending: ClassVar[str]
    """Of the files, with the dot."""

    @property
    @abc.abstractmethod
    def settings(self) -> Mapping[str, Any]:
        """All that decides what comes out of a material, as JSON has it."""

    @abc.abstractmethod
    def fit(self, brdf: Brdf, progress: Progress) -> Brdf:
        """The fit to a reflectance.

        Raises
        ------
        NacreError
            If it cannot be fitted.
        """

    @abc.abstractmethod
    def encode(self, fitted: Brdf) -> bytes:
        """The content of the file of a fit.

        Raises
        ------
        NacreError
            If it cannot be written.
        """

    @abc.abstractmethod
    def losses(self, fitted: Brdf) -> dict[str, float]:
        """How good a fit is, by name."""

    def check(self) -> None:  # noqa: B027 - most have nothing to check
        """Raise what any fit would raise, whatever the material.

        Raises
        ------
        NacreError
            If nothing can be fitted in this way on this machine.
        """

    @property
    def digest(self) -> str:
        """SHA-256 of the settings, in hexadecimal."""
        text = json.dumps({"ending": self.ending, **self.settings}, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()


@dataclass(frozen=True)
class NetworkFitting(Fitting):
    """Neural materials, in `.safetensors` files.

    Parameters
    ----------
    recipe
        Settings of :func:`nacre.fit`.
    device
        None for the compiled CPU kernel, or a PyTorch device.
    """

    ending: ClassVar[str] = ".safetensors"
    recipe: Recipe = field(default_factory=Recipe)
    device: str | None = None

    @property
    def settings(self) -> Mapping[str, Any]:
        """See :class:`Fitting`."""
        return {"model": "nbrdf", "device": self.device, **asdict(self.recipe)}

    def fit(self, brdf: Brdf, progress: Progress) -> NeuralBrdf:
        """See :class:`Fitting`."""
        return neural.fit(brdf, self.recipe, device=self.device, progress=progress)

    def encode(self, fitted: Brdf) -> bytes:
        """See :class:`Fitting`."""
        assert isinstance(fitted, NeuralBrdf)
        return neural_file.encode(fitted)

    def losses(self, fitted: Brdf) -> dict[str, float]:
        """See :class:`Fitting`."""
        assert isinstance(fitted, NeuralBrdf)
        return _finite(fitted.metadata["quality"])

    def check(self) -> None:
        """See :class:`Fitting`: whether there is such a device.

        Raises
        ------
        NacreError
            If PyTorch is not installed, or has no such device here.
        """
        if self.device is not None:
            from nacre.runtime.device import open_device

            open_device(self.device)


@dataclass(frozen=True)
class AnalyticFitting(Fitting):
    """Analytic models, in `.json` files.

    Parameters
    ----------
    model
        Class of the model.
    options
        Keywords of :func:`nacre.analytic.fit` that are not left at their defaults.
    """

    ending: ClassVar[str] = ".json"
    model: type[AnalyticBrdf]
    options: Mapping[str, Any] = field(default_factory=dict)

    @property
    def settings(self) -> Mapping[str, Any]:
        """See :class:`Fitting`."""
        return {"model": self.model.model, **self.options}

    def fit(self, brdf: Brdf, progress: Progress) -> AnalyticBrdf:
        """See :class:`Fitting`."""
        return analytic.fit(brdf, self.model, progress=progress, **self.options)

    def encode(self, fitted: Brdf) -> bytes:
        """See :class:`Fitting`."""
        assert isinstance(fitted, AnalyticBrdf)
        return analytic_file.encode(fitted)

    def losses(self, fitted: Brdf) -> dict[str, float]:
        """See :class:`Fitting`."""
        assert isinstance(fitted, AnalyticBrdf)
        return _finite({"loss": fitted.metadata["fit"]["loss"]})


def _finite(values: Mapping[str, float]) -> dict[str, float]:
    """Those that JSON can hold."""
    return {name: float(value) for name, value in values.items() if math.isfinite(value)}
