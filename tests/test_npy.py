"""NumPy's array files: what NumPy writes is read, what promises too much is refused."""

from __future__ import annotations

import io

import numpy as np
import pytest
from numpy.lib import format as npy

from nacre.files import FormatError
from nacre.npy import MAGIC, parse_npy


def written(array: np.ndarray, version: tuple[int, int] = (1, 0)) -> bytes:
    content = io.BytesIO()
    npy.write_array(content, array, version)
    return content.getvalue()


@pytest.mark.parametrize("dtype", ["<f2", ">f4", "<f8"])
@pytest.mark.parametrize("shape", [(), (3,), (2, 3), (2, 3, 4)])
@pytest.mark.parametrize("order", ["C", "F"])
def test_what_numpy_writes_is_read(dtype, shape, order):
    size = int(np.prod(shape))
    array = np.asarray(np.arange(size).reshape(shape), dtype=dtype, order=order)
    data = written(array)
    assert data.startswith(MAGIC)
    back = parse_npy(data, "x.npy")
    assert back.dtype == array.dtype
    np.testing.assert_array_equal(back, array)
    with pytest.raises(ValueError, match="read-only"):
        back[...] = 0


def header(shape: str, descr: str = "'<f8'") -> bytes:
    text = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return MAGIC + b"\1\0" + len(text).to_bytes(2, "little") + text


@pytest.mark.parametrize(
    "data",
    [
        b"",
        MAGIC,
        written(np.zeros(3))[:-1],
        written(np.zeros(3)) + b"\0",
        written(np.zeros(3, int)),
        written(np.zeros(3), (2, 0)),
        header("(3,)", "'|O'") + bytes(24),
        header("(3,)", "[('a', '<f8')]") + bytes(24),
        header("(-1, -3)") + bytes(24),
        header("(-3,)"),
        header("(1 << 62, 1 << 62)"),
        header(f"({2**62}, {2**62})") + bytes(24),
        header("'3'") + bytes(24),
        header("(3,)", "__import__('os')") + bytes(24),
    ],
)
def test_what_is_damaged_is_refused_in_one_line(data):
    with pytest.raises(FormatError, match=r"^x\.npy: ") as caught:
        parse_npy(data, "x.npy")
    assert "\n" not in str(caught.value)
