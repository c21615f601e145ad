"""Fixtures of the rendering tests: Mitsuba in a variant, reflectances, scenes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nacre.mitsuba
from tests.variants import USUAL, require_mitsuba


def _variant(name: str) -> Any:
    mi = require_mitsuba()
    mi.set_variant(name.replace("llvm", USUAL.partition("_")[0]))
    nacre.mitsuba.register()
    return mi


@pytest.fixture
def rgb() -> Any:
    """Mitsuba in the variant that tests draw by."""
    return _variant(USUAL)


@pytest.fixture
def spectral() -> Any:
    """Mitsuba in llvm_ad_spectral."""
    return _variant("llvm_ad_spectral")


@pytest.fixture
def mono() -> Any:
    """Mitsuba in llvm_ad_mono."""
    return _variant("llvm_ad_mono")


@pytest.fixture
def polarized() -> Any:
    """Mitsuba in llvm_ad_mono_polarized."""
    return _variant("llvm_ad_mono_polarized")


@pytest.fixture
def scalar() -> Any:
    """Mitsuba in scalar_rgb."""
    return _variant("scalar_rgb")


@pytest.fixture
def directions() -> tuple[np.ndarray, np.ndarray]:
    """Pairs (wi, wo), shape (2000, 3): uniform over the sphere, so three in four are dark."""
    random = np.random.default_rng(7)
    vectors = random.normal(size=(2, 2000, 3))
    vectors /= np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors[0].astype(np.float32), vectors[1].astype(np.float32)
