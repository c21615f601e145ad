"""Kernels that are kept, as Dr.Jit's own history of what it ran tells."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from nacre.analytic.lambert import Lambert
from nacre.mitsuba import bsdf, kernels
from nacre.mitsuba.preview import render_scene


def _render(mi: Any, albedo: float) -> tuple[Any, int]:
    """A picture of a material of its own, and how many of its kernels were in memory already."""
    import drjit as dr

    scene = {
        "type": "scene",
        "integrator": {"type": "direct", "bsdf_samples": 1, "emitter_samples": 0},
        "light": {"type": "constant"},
        "sensor": {"type": "orthographic", "film": {"type": "hdrfilm", "width": 4, "height": 4}},
        "wall": {
            "type": "rectangle",
            "to_world": mi.ScalarTransform4f().translate([0, 0, 2]).rotate([0, 1, 0], 180),
            "bsdf": bsdf(Lambert(diffuse=(albedo,) * 3)),
        },
    }
    loaded = mi.load_dict(scene)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        picture = render_scene(loaded, 1)
        history = dr.kernel_history([dr.KernelType.JIT])
    return picture, sum(k["cache_hit"] and not k["cache_disk"] for k in history)


def test_kernels_of_few_materials_stay(rgb: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernels, "MAX_MATERIALS", 3)
    monkeypatch.setattr(kernels, "_compiled", 4)  # so that the first picture finds none
    (first, hits), (again, repeated) = _render(rgb, 0.31), _render(rgb, 0.31)
    assert hits < repeated
    assert first.min() > 0.0
    _render(rgb, 0.32)
    after, released = _render(rgb, 0.31)
    assert released == repeated
    for number in range(3):
        _render(rgb, 0.33 + 0.01 * number)
    last, missing = _render(rgb, 0.31)
    assert missing < repeated
    for other in (again, after, last):
        np.testing.assert_array_equal(first, other)
