"""nacre: measured materials as compact neural BRDFs.

The names below are the public interface; heavy libraries load on first use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import lazy_loader

if TYPE_CHECKING:
    from nacre import (
        analytic,
        download,
        evaluate,
        formats,
        geometry,
        latent,
        library,
        measured,
        neural,
        render,
        sampling,
    )
    from nacre.brdf import Brdf, CosineSampler, Sampler
    from nacre.files import FormatError, MissingExtraError, NacreError
    from nacre.formats import load, save
    from nacre.neural import NeuralBrdf, Recipe, fit, fit_many

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
    "analytic",
    "download",
    "evaluate",
    "fit",
    "fit_many",
    "formats",
    "geometry",
    "latent",
    "library",
    "load",
    "measured",
    "neural",
    "render",
    "sampling",
    "save",
]

__getattr__, __dir__, _ = lazy_loader.attach(
    __name__,
    submodules=[
        "analytic",
        "download",
        "evaluate",
        "formats",
        "geometry",
        "latent",
        "library",
        "measured",
        "neural",
        "render",
        "sampling",
    ],
    submod_attrs={
        "brdf": ["Brdf", "CosineSampler", "Sampler"],
        "files": ["FormatError", "MissingExtraError", "NacreError"],
        "formats": ["load", "save"],
        "neural": ["NeuralBrdf", "Recipe", "fit", "fit_many"],
    },
)
