"""A BSDF in one variant of Mitsuba: its reflection that is not a mirror's.

Mitsuba's `si.wi` is our `wo`, and its `wo` our `wi`; its values have the cosine in them.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.errors import MissingExtraError, NacreError, reason, require
from nacre.mitsuba import engine, llvm
from nacre.mitsuba.plugins import register

VARIANTS = "scalar_rgb", "llvm_ad_rgb", "llvm_ad_spectral"
"""Variants of Mitsuba that f_r is compared in."""

MAIN = "llvm_ad_rgb"
"""The variant in which everything but that is checked."""
_BANDS = 40  # wavelengths at which spectra are turned into colors, a multiple of four


def missing_variants() -> frozenset[str]:
    """Those of :data:`VARIANTS` that do not work here; all without Mitsuba or LLVM."""
    llvm.prepare()
    try:
        mi = require("mitsuba", "render")
        engine.check_llvm()
    except (MissingExtraError, NacreError):
        return frozenset(VARIANTS)
    return frozenset(VARIANTS) - frozenset(mi.variants())


class VariantBsdf:
    """A BSDF in one variant.

    Parameters
    ----------
    variant
        Name of a variant of Mitsuba.
    make
        Makes the BSDF when that variant is set.
    """

    def __init__(self, variant: str, make: Callable[[], Any]) -> None:
        self.variant = variant
        self.mi = require("mitsuba", "render")
        self.dr = require("drjit", "render")
        engine.mitsuba()  # where no variant is set there is none to come back to
        register()
        with self.set():
            self.bsdf = make()

    def set(self) -> Any:
        """A block in which the variant is set."""
        if self.mi.variant() == self.variant:
            return nullcontext()
        return self.mi.variant_context(self.variant)

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        """f_r in 1/sr, shape (n, 3)."""
        if not len(wi):
            return np.zeros((0, 3))
        with self.set():
            if self.variant.startswith("scalar"):
                found = [self._value(a, b) for a, b in zip(wi, wo, strict=True)]
                values = np.asarray(found, float).reshape(len(wi), -1)
            elif self.mi.is_spectral:
                values = self._color(wi, wo)
            else:
                values = np.broadcast_to(np.array(self._value(wi, wo), float).T, (len(wi), 3))
        return np.where((wi[:, 2] > 0.0)[:, None], values / wi[:, 2:], 0.0)

    def _value(self, wi: Floats, wo: Floats) -> Any:
        """Mitsuba's value, with the cosine."""
        interaction = self.interaction(wo)
        try:
            return self.bsdf.eval(self.mi.BSDFContext(), interaction, self.vector(wi))
        except RuntimeError as error:
            raise NacreError(f"Mitsuba cannot evaluate it: {reason(error)}") from error

    def _color(self, wi: Floats, wo: Floats) -> Floats:
        """Colors under D65 of the values at wavelengths, shape (n, 3)."""
        mi = self.mi
        nm = np.linspace(380.0, 760.0, _BANDS)
        rows = _BANDS // 4
        lights, views = (np.repeat(w, rows, axis=0) for w in (wi, wo))
        interaction = self.interaction(views)
        kind = type(interaction.wavelengths)
        given = np.tile(nm.reshape(rows, 4), (len(wi), 1)).T
        interaction.wavelengths = kind(np.ascontiguousarray(given, np.float32))
        found = np.array(
            self.bsdf.eval(self.mi.BSDFContext(), interaction, self.vector(lights)), float
        )
        spectra = found.T.reshape(len(wi), _BANDS)
        xyz = np.stack([np.array(c, float).ravel() for c in mi.cie1931_xyz(mi.Float(nm))])
        white = self.dr.zeros(mi.SurfaceInteraction3f, rows)
        white.wavelengths = kind(np.ascontiguousarray(nm.reshape(rows, 4).T, np.float32))
        lamp = np.array(mi.load_dict({"type": "d65"}).eval(white), float).T.ravel()
        weights = xyz * lamp
        colors = spectra @ (weights / weights[1].sum()).T
        return np.array(mi.xyz_to_srgb(mi.Color3f(np.float32(colors.T))), float).T

    def vector(self, w: Floats) -> Any:
        """Directions, shape (n, 3) or (3,), as the variant holds them."""
        return self.mi.Vector3f(np.ascontiguousarray(w.T, np.float32))

    def interaction(self, wo: Floats) -> Any:
        """The checked point, seen from `wo`: on the plane z = 0, in the middle of a texture."""
        mi = self.mi
        shape = [len(wo)] if wo.ndim > 1 else []
        found = self.dr.zeros(mi.SurfaceInteraction3f, *shape)
        x, y, z = mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0), mi.Vector3f(0, 0, 1)
        found.n = mi.Normal3f(z)
        found.sh_frame = mi.Frame3f(x, y, z)
        found.dp_du, found.dp_dv = x, y
        found.uv = mi.Point2f(0.5, 0.5)
        found.wi = self.vector(wo)
        return found
