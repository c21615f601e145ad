"""Rendering: Mitsuba plugins for any material.

Mitsuba, and all that needs it, loads on first use. The spheres of :mod:`nacre.mitsuba.sphere` do
not need it.
"""

from typing import TYPE_CHECKING

import lazy_loader

if TYPE_CHECKING:
    from nacre.mitsuba.engine import LLVMError as LLVMError
    from nacre.mitsuba.engine import mitsuba as mitsuba
    from nacre.mitsuba.passes import wavefronts as wavefronts
    from nacre.mitsuba.plugins import bsdf as bsdf
    from nacre.mitsuba.plugins import register as register
    from nacre.mitsuba.preview import render_preview as render_preview
    from nacre.mitsuba.scene_rendering import render_file as render_file

__getattr__, __dir__, __all__ = lazy_loader.attach(
    __name__,
    submod_attrs={
        "engine": ["LLVMError", "mitsuba"],
        "passes": ["wavefronts"],
        "plugins": ["bsdf", "register"],
        "preview": ["render_preview"],
        "scene_rendering": ["render_file"],
    },
)
