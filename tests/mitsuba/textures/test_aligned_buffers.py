"""Rows of numbers in memory: what is read, and that aligned ones are read at once."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from nacre.array import aligned_zeros
from nacre.mitsuba.textures.texels import AlignedBuffer


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.int32])
@pytest.mark.parametrize("size", [4, 8, 16])
def test_rows_are_read(rgb: Any, dtype: Any, size: int) -> None:
    values = aligned_zeros((7, size), dtype)
    values[...] = np.random.default_rng(1).integers(-100, 100, values.shape)
    index = np.array([6, 0, 3, 3, 5], np.uint32)
    found = np.array(AlignedBuffer(rgb, values)[rgb.UInt32(index)]).T
    np.testing.assert_array_equal(found, values[index])


@pytest.mark.parametrize("shift", [0, 4])
def test_aligned_rows_alone_are_read_at_once(rgb: Any, shift: int) -> None:
    import drjit as dr

    if not rgb.variant().startswith("llvm"):
        pytest.skip("looks at the code that Dr.Jit writes for LLVM")
    values = aligned_zeros((10 * 8,), np.float16)[shift : shift + 72].reshape(-1, 8)
    rows = AlignedBuffer(rgb, values)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        dr.eval(rows[rgb.UInt32([3, 1, 4])])
        (kernel,) = dr.kernel_history([dr.KernelType.JIT])
    assert ("gather_8xf16" in kernel["ir"].getvalue()) == (shift == 0)


def test_zeros_begin_at_lines_of_the_cache() -> None:
    for count in range(1, 40):
        zeros = aligned_zeros((count, 3), np.float16)
        assert zeros.shape == (count, 3)
        assert zeros.dtype == np.float16
        assert not zeros.any()
        assert zeros.ctypes.data % 64 == 0
