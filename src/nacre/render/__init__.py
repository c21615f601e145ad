"""Rendering: Mitsuba plugins for any material. Mitsuba loads on first use."""

from nacre.render.engine import LLVMError, mitsuba
from nacre.render.plugins import bsdf, register
from nacre.render.preview import render_preview
from nacre.render.scene_file import render_file

__all__ = ["LLVMError", "bsdf", "mitsuba", "register", "render_file", "render_preview"]
