"""Mitsuba's materials as reflectances, to be measured virtually."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nacre.array import Components
from nacre.brdf import Brdf
from nacre.files import NacreError
from nacre.geometry import join
from nacre.render.engine import mitsuba


class MitsubaBrdf(Brdf):
    """The reflectance of a Mitsuba BSDF, evaluated by Mitsuba in an RGB variant that compiles.

    Parameters
    ----------
    bsdf
        A BSDF, or a dictionary for `mitsuba.load_dict`. Without textures: it is evaluated at one
        point.
    name
        Name of the material.

    Raises
    ------
    NacreError
        If the variant that is set is no such variant.
    MissingExtraError
        If Mitsuba is not installed.
    LLVMError
        If there is no LLVM that Mitsuba can use.
    """

    def __init__(self, bsdf: Mapping[str, Any] | Any, name: str = "") -> None:
        self._mi = mitsuba()
        if not self._mi.variant().endswith("_ad_rgb"):
            raise NacreError(
                f"needs Mitsuba's llvm_ad_rgb or cuda_ad_rgb, not {self._mi.variant()}"
            )
        self._bsdf = self._mi.load_dict(dict(bsdf)) if isinstance(bsdf, Mapping) else bsdf
        self.isotropic = not self._bsdf.flags() & int(self._mi.BSDFFlags.Anisotropic)
        self.name = name

    def eval_components(self, wi: Components, wo: Components) -> Components:
        """See :class:`nacre.brdf.Brdf`; NumPy arrays only."""
        mi = self._mi
        interaction = mi.SurfaceInteraction3f()
        interaction.wi = mi.Vector3f(np.ascontiguousarray(join(wo).T, np.float32))
        light = mi.Vector3f(np.ascontiguousarray(join(wi).T, np.float32))
        value = self._bsdf.eval(mi.BSDFContext(), interaction, light)
        # Mitsuba's value has the cosine in it; below the horizon it is 0 and the ratio unused.
        rgb = np.array(value) / np.where(wi[2] > 0, wi[2], 1.0)
        return rgb[0], rgb[1], rgb[2]
