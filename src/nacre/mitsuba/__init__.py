"""Rendering: Mitsuba plugins for any material. Mitsuba loads on first use."""

from nacre.mitsuba.engine import LLVMError, mitsuba
from nacre.mitsuba.plugins import bsdf, register
from nacre.mitsuba.preview import render_preview
from nacre.mitsuba.scene_file import render_file

__all__ = ["LLVMError", "bsdf", "mitsuba", "register", "render_file", "render_preview"]
