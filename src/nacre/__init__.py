"""nacre: measured materials as compact neural BRDFs.

The names below are the public interface; heavy libraries load on first use.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

import lazy_loader

from nacre.objects.described import draw_by

if TYPE_CHECKING:
    from nacre import (
        analytic,
        array,
        brdf,
        btf,
        color,
        download,
        errors,
        figures,
        formats,
        geometry,
        included,
        instruments,
        latent,
        measured,
        metrics,
        mitsuba,
        neural,
        registry,
        sampling,
        soundness,
        targets,
        testing,
        textures,
        verbs,
        workflows,
    )
    from nacre.brdf import Brdf, CosineSampler, Sampler
    from nacre.btf import Btf, TableBtf
    from nacre.errors import FormatError, MissingExtraError, NacreError
    from nacre.formats import load, save
    from nacre.included import materials
    from nacre.neural import NeuralBrdf, Recipe, fit_many
    from nacre.verbs import check, compare, convert, estimate, export, fit, info, plot, render, view

__version__ = "0.2.0"

__all__ = [
    "Brdf",
    "Btf",
    "CosineSampler",
    "FormatError",
    "MissingExtraError",
    "NacreError",
    "NeuralBrdf",
    "Recipe",
    "Sampler",
    "TableBtf",
    "__version__",
    "analytic",
    "array",
    "brdf",
    "btf",
    "check",
    "color",
    "compare",
    "convert",
    "download",
    "errors",
    "estimate",
    "export",
    "figures",
    "fit",
    "fit_many",
    "formats",
    "geometry",
    "included",
    "info",
    "instruments",
    "latent",
    "load",
    "materials",
    "measured",
    "metrics",
    "mitsuba",
    "neural",
    "plot",
    "registry",
    "render",
    "sampling",
    "save",
    "soundness",
    "targets",
    "testing",
    "textures",
    "verbs",
    "view",
    "workflows",
]

_ATTRIBUTES = {
    "brdf": ["Brdf", "CosineSampler", "Sampler"],
    "btf": ["Btf", "TableBtf"],
    "errors": ["FormatError", "MissingExtraError", "NacreError"],
    "formats": ["load", "save"],
    "included": ["materials"],
    "neural": ["NeuralBrdf", "Recipe", "fit_many"],
    "verbs": ["check", "compare", "convert", "estimate", "fit", "info", "plot", "view"],
}

__getattr__, _, _ = lazy_loader.attach(
    __name__,
    submodules=set(__all__).difference(["__version__"], *_ATTRIBUTES.values()),
    submod_attrs=_ATTRIBUTES,
)


def _picture(material: object) -> str:
    """What notebooks show of a material; what draws is imported with the first."""
    return str(importlib.import_module(f"{__name__}.viewer.notebook").live(material))


draw_by(_picture)


def __dir__() -> list[str]:
    """The public names, and those that every module has."""
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})
