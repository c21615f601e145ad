"""The materials of `docs/results/soundness.md`: Mitsuba's BSDFs, and nacre's own."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import nacre
from nacre.mitsuba.engine import mitsuba
from nacre.soundness import Subject, described, subject
from tests.analytic.materials import EXAMPLES
from tests.soundness.faults import GLOSSY

GRAY = {"type": "rgb", "value": 0.5}
ROUGH = {"type": "roughconductor", "alpha": 0.3}
NETWORKS = "rgl:paper_white", "nielsen:bluebook", "merl:gold-paint", "nbrdf-rgl:paper_white"

MITSUBA: dict[str, dict[str, Any]] = {
    "diffuse": {"type": "diffuse"},
    "conductor": {"type": "conductor"},
    "roughconductor, GGX": {"type": "roughconductor", "distribution": "ggx", "alpha": 0.2},
    "roughconductor, Beckmann": {"type": "roughconductor", "alpha": 0.2},
    "roughconductor, alpha 0.002": {"type": "roughconductor", "alpha": 0.002},
    "roughconductor, anisotropic": {"type": "roughconductor", "alpha_u": 0.4, "alpha_v": 0.1},
    "roughconductor, all normals": {
        "type": "roughconductor", "alpha": 0.2, "sample_visible": False,
    },
    "dielectric": {"type": "dielectric"},
    "thindielectric": {"type": "thindielectric"},
    "roughdielectric": {"type": "roughdielectric", "alpha": 0.2},
    "plastic": {"type": "plastic"},
    "plastic, nonlinear": {"type": "plastic", "nonlinear": True},
    "roughplastic": {"type": "roughplastic"},
    "roughplastic, nonlinear": {"type": "roughplastic", "nonlinear": True},
    "pplastic": {"type": "pplastic"},
    "principled": {"type": "principled"},
    "principled, metallic": {"type": "principled", "metallic": 0.9, "roughness": 0.3},
    "principled, clearcoat": {"type": "principled", "clearcoat": 1.0, "clearcoat_gloss": 0.8},
    "principled, sheen": {"type": "principled", "sheen": 1.0, "flatness": 0.5},
    "principled, anisotropic": {"type": "principled", "anisotropic": 0.8, "roughness": 0.3},
    "principled, transmission": {"type": "principled", "spec_trans": 0.5},
    "principledthin": {"type": "principledthin"},
    "hair": {"type": "hair"},
    "null": {"type": "null"},
    "blendbsdf": {
        "type": "blendbsdf", "weight": 0.4, "a": {"type": "diffuse"}, "b": ROUGH,
    },
    "mask": {"type": "mask", "opacity": 0.7, "nested": ROUGH},
    "twosided": {"type": "twosided", "nested": ROUGH},
}  # fmt: skip
"""Each by what stands for it in the table; those made of textures are in :func:`textured`."""


TILTED = "a tilted normal changes what the surface is, not only how it is lit"
UNTOLD = "a BSDF's flags do not tell that a texture tilts the normal"
DESIGN: dict[str, dict[str, str]] = {
    **{name: {"reciprocity": TILTED, "isotropy": UNTOLD} for name in ("normalmap", "bumpmap")},
    "hair": {
        "reciprocity": "its cosine is about the axis of a fiber, not a normal",
        "variants": "its colors are exponentials of spectra, which colors do not give",
    },
}
"""Properties that BSDFs of Mitsuba need not have, with the reason."""


def textured() -> dict[str, dict[str, Any]]:
    """BSDFs of Mitsuba that take a picture or a file."""
    mi = mitsuba()
    tilted = np.zeros((4, 4, 3), np.float32)
    tilted[...] = 0.5 + 0.5 * np.array([0.28, 0.0, 0.96])
    slope = np.linspace(0.0, 0.2, 8, dtype=np.float32)[None, :, None].repeat(8, 0)
    picture = {"type": "bitmap", "raw": True}
    nested = {"type": "roughplastic", "alpha": 0.3}
    return {
        "normalmap": {
            "type": "normalmap", "nested": nested,
            "normalmap": {**picture, "bitmap": mi.Bitmap(tilted)},
        },
        "bumpmap": {
            "type": "bumpmap", "nested": nested,
            "bump": {**picture, "bitmap": mi.Bitmap(slope)},
        },
    }  # fmt: skip


def mitsubas() -> Iterator[tuple[str, Callable[[], Subject]]]:
    """Every BSDF that Mitsuba ships and that reflects."""
    for name, description in (MITSUBA | textured()).items():
        yield name, partial(described, description, name)
    yield "measured", _measured


def _measured() -> Subject:
    folder = tempfile.mkdtemp(prefix="nacre-soundness-")
    path = Path(folder) / "glossy.bsdf"
    nacre.save(GLOSSY, path)
    return described({"type": "measured", "filename": str(path)}, "measured")


def ours() -> Iterator[tuple[str, Callable[[], Subject]]]:
    """Analytic models, standard materials, networks, and plugins for Mitsuba."""
    for name, brdf in EXAMPLES.items():
        yield name, partial(subject, brdf, name)
    for name in NETWORKS:
        yield name, partial(_loaded, name)
    plugin = str(nacre.included.resolve("rgl:paper_white"))
    for kind in ("nbrdf", "brdf"):
        about = {"type": kind, "filename": plugin}
        yield f"{kind}, rgl:paper_white", partial(described, about, f"{kind}, rgl:paper_white")


def _loaded(name: str) -> Subject:
    return subject(nacre.load(name), name)
