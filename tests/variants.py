"""The one way in which tests reach Mitsuba."""

from __future__ import annotations

import os
from typing import Any

import pytest

from nacre.mitsuba import llvm
from nacre.mitsuba.engine import DEFAULT_VARIANT, VARIABLE

USUAL = os.environ.get(VARIABLE) or DEFAULT_VARIANT
"""The variant that tests draw by: `NACRE_VARIANT=cuda_ad_rgb` runs them on a graphics card."""


def by_precision(single: float, half: float = 2e-2) -> float:
    """The tolerance of what cooperative vectors compute: on CUDA these have 16 bits."""
    return half if USUAL.startswith("cuda") else single


def require_mitsuba(variant: str = USUAL) -> Any:
    """Mitsuba with a variant set; skips the calling test where it cannot run."""
    if variant.startswith("llvm") and llvm.prepare() is None:
        pytest.skip(f"needs LLVM {llvm.MINIMUM} or newer")
    mi = pytest.importorskip("mitsuba", reason="needs the extra 'render'")
    mi.set_variant(variant)
    return mi
