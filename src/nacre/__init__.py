"""nacre: measured materials as compact neural BRDFs.

The names below are the public interface; heavy libraries load on first use.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nacre import evaluate, formats, geometry, measured, neural, render, sampling
    from nacre.brdf import Brdf, CosineSampler, Sampler
    from nacre.files import FormatError, MissingExtraError, NacreError
    from nacre.formats import load, save
    from nacre.neural import NeuralBrdf, Recipe, fit

__version__ = "0.1.0"

__all__ = [
    "Brdf",
    "CosineSampler",
    "FormatError",
    "MissingExtraError",
    "NacreError",
    "NeuralBrdf",
    "Recipe",
    "Sampler",
    "__version__",
    "evaluate",
    "fit",
    "formats",
    "geometry",
    "load",
    "measured",
    "neural",
    "render",
    "sampling",
    "save",
]

_homes = {
    "Brdf": "nacre.brdf",
    "CosineSampler": "nacre.brdf",
    "Sampler": "nacre.brdf",
    "FormatError": "nacre.files",
    "MissingExtraError": "nacre.files",
    "NacreError": "nacre.files",
    "NeuralBrdf": "nacre.neural",
    "Recipe": "nacre.neural",
    "fit": "nacre.neural",
    "load": "nacre.formats",
    "save": "nacre.formats",
}
_modules = ("evaluate", "formats", "geometry", "measured", "neural", "render", "sampling")


def __getattr__(name: str) -> Any:
    if name in _homes:
        return getattr(importlib.import_module(_homes[name]), name)
    if name in _modules:
        return importlib.import_module(f"nacre.{name}")
    raise AttributeError(f"module 'nacre' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
