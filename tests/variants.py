"""The one way in which tests reach Mitsuba."""

from __future__ import annotations

from typing import Any

import pytest

from nacre.render import llvm


def require_mitsuba(variant: str = "llvm_ad_rgb") -> Any:
    """Mitsuba with a variant set; skips the calling test where it cannot run."""
    if variant.startswith("llvm") and llvm.prepare() is None:
        pytest.skip(f"needs LLVM {llvm.MINIMUM} or newer")
    mi = pytest.importorskip("mitsuba", reason="needs the extra 'render'")
    mi.set_variant(variant)
    return mi
