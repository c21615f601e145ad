"""Rendering: Mitsuba plugins for any reflectance. Mitsuba loads on first use."""

from nacre.render.engine import LLVMError, mitsuba
from nacre.render.plugins import bsdf, register
from nacre.render.textures.plugins import texture_bsdf

__all__ = ["LLVMError", "bsdf", "mitsuba", "register", "texture_bsdf"]
