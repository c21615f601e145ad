"""Mitsuba's materials as reflectances, for virtual measurement."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nacre.array import Components
from nacre.errors import NacreError, reason, require
from nacre.geometry import join
from nacre.measured.symmetry import unchanged_by_quarter_turn
from nacre.mitsuba.engine import mitsuba
from nacre.sampling import LobeSampledBrdf


class MitsubaBrdf(LobeSampledBrdf):
    """The reflectance of a Mitsuba BSDF, evaluated by Mitsuba in an RGB variant that compiles.

    Parameters
    ----------
    bsdf
        A BSDF, or a dictionary for `mitsuba.load_dict`; as an attribute, always the BSDF. Textures,
        bumps and normals are those at one point, in the middle of the texture.

    Raises
    ------
    NacreError
        If another kind of variant is set, or Mitsuba cannot evaluate the BSDF at a point without a
        shape.
    MissingExtraError
        If Mitsuba is not installed.
    LLVMError
        If there is no LLVM that Mitsuba can use.
    """

    traceable = False
    isotropy_known = True

    def __init__(self, bsdf: Mapping[str, Any] | Any, name: str = "") -> None:
        super().__init__(name=name)
        self._mi = mitsuba()
        if not self._mi.variant().endswith("_ad_rgb"):
            raise NacreError(
                f"needs Mitsuba's llvm_ad_rgb or cuda_ad_rgb, not {self._mi.variant()}"
            )
        self.bsdf = self._mi.load_dict(dict(bsdf)) if isinstance(bsdf, Mapping) else bsdf
        self.name = name
        # Flags do not cover normals that a texture tilts.
        anisotropic = self.bsdf.flags() & int(self._mi.BSDFFlags.Anisotropic)
        self.isotropic = not anisotropic and unchanged_by_quarter_turn(self)

    def left_out(self) -> list[str]:
        """Effects of the BSDF that no reflectance has, for people; mostly empty."""
        flags = self._mi.BSDFFlags
        parts = {
            "mirror reflection": int(flags.DeltaReflection),
            "transmission": int(flags.Transmission) | int(flags.Null),
        }
        return [name for name, bits in parts.items() if self.bsdf.flags() & bits]

    def eval_components(self, wi: Components, wo: Components) -> Components:
        """See :class:`nacre.brdf.Brdf`; NumPy arrays only.

        Raises NacreError if Mitsuba cannot evaluate the BSDF there, or values are not finite.
        """
        mi = self._mi
        view = mi.Vector3f(np.ascontiguousarray(join(wo).T, np.float32))
        light = mi.Vector3f(np.ascontiguousarray(join(wi).T, np.float32))
        interaction = self._interaction(np.size(wo[2]))
        interaction.wi = view
        try:
            value = np.array(self.bsdf.eval(mi.BSDFContext(), interaction, light))
        except RuntimeError as error:  # a texture that needs the shape it lies on
            message = f"Mitsuba cannot evaluate it at a point; try a bitmap: {reason(error)}"
            raise NacreError(message) from error
        if not np.isfinite(value).all():
            called = self.name or "the BSDF"
            raise NacreError(
                f"{called} gives values that are not finite; is a parameter too large?"
            )
        # Mitsuba's value has the cosine in it; below the horizon it is 0 and the ratio unused.
        rgb = value / np.where(wi[2] > 0, wi[2], 1.0)
        return rgb[0], rgb[1], rgb[2]

    def _interaction(self, count: int) -> Any:
        """The measured point, `count` times: on the plane z = 0, in the middle of a texture."""
        mi = self._mi
        interaction = require("drjit", "render").zeros(mi.SurfaceInteraction3f, count)
        x, y, z = mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0), mi.Vector3f(0, 0, 1)
        interaction.n = mi.Normal3f(z)
        interaction.sh_frame = mi.Frame3f(x, y, z)
        interaction.dp_du, interaction.dp_dv = x, y
        interaction.uv = mi.Point2f(0.5, 0.5)
        return interaction
