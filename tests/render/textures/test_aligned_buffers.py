"""Packets of numbers: what is read, and that they are read at once wherever memory was free."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from nacre.array import aligned_zeros
from nacre.render.textures.aligned_buffers import Packets


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.int32])
@pytest.mark.parametrize("size", [4, 8, 16])
def test_packets_are_rows(rgb: Any, dtype: Any, size: int) -> None:
    values = aligned_zeros((7, size), dtype)
    values[...] = np.random.default_rng(1).integers(-100, 100, values.shape)
    index = np.array([6, 0, 3, 3, 5], np.uint32)
    found = np.array(Packets(rgb, values)[rgb.UInt32(index)]).T
    np.testing.assert_array_equal(found, values[index])


@pytest.mark.parametrize("shift", [0, 8])
def test_packets_are_read_at_once_from_lines_of_the_cache_alone(rgb: Any, shift: int) -> None:
    import drjit as dr

    values = aligned_zeros((10 * 8,), np.float16)[shift:].reshape(-1, 8)
    packets = Packets(rgb, values)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        dr.eval(packets[rgb.UInt32([3, 1, 4])])
        (kernel,) = dr.kernel_history([dr.KernelType.JIT])
    assert ("gather_8xf16" in kernel["ir"].getvalue()) == (shift == 0)


def test_zeros_begin_at_lines_of_the_cache() -> None:
    for count in range(1, 40):
        zeros = aligned_zeros((count, 3), np.float16)
        assert zeros.shape == (count, 3)
        assert zeros.dtype == np.float16
        assert not zeros.any()
        assert zeros.ctypes.data % 64 == 0
