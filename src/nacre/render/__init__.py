"""Rendering: Mitsuba plugins for any reflectance. Mitsuba loads on first use."""

from nacre.render.btf.plugins import texture_bsdf
from nacre.render.engine import LLVMError, mitsuba
from nacre.render.plugins import bsdf, register

__all__ = ["LLVMError", "bsdf", "mitsuba", "register", "texture_bsdf"]
