"""NumPy's `.npy` arrays, read without trust in what their headers promise.

The layout is described in the documentation of :mod:`numpy.lib.format`.
"""

from __future__ import annotations

import io
import math
from typing import Any

import numpy as np
import numpy.lib.format as npy
import numpy.typing as npt

from nacre.files import FormatError, reason

MAGIC = npy.MAGIC_PREFIX
"""First bytes of every file."""


def parse_npy(data: bytes, where: str) -> npt.NDArray[Any]:
    """The array of floating-point numbers in a version 1.0 `.npy` file.

    Parameters
    ----------
    data
        Content of the file.
    where
        What error messages start with: the file's path, and the array's name where it has several.

    Returns
    -------
    array
        Read-only, of the shape and type in the header.

    Raises
    ------
    FormatError
        If the header is damaged, of another version or type, or its shape does not need exactly
        the bytes that follow.
    """
    file = io.BytesIO(data)
    try:
        if npy.read_magic(file) != (1, 0):
            raise FormatError(f"{where}: is not a version 1.0 .npy file")
        shape, fortran, dtype = npy.read_array_header_1_0(file)
    except FormatError:
        raise
    except Exception as error:  # NumPy's header parser fails in many ways
        raise FormatError(f"{where}: is not a whole .npy file: {reason(error)}") from error
    left = len(data) - file.tell()
    if dtype.kind != "f" or min(shape, default=1) < 0 or math.prod(shape) * dtype.itemsize != left:
        raise FormatError(f"{where}: header promises {shape} {dtype}, {left} bytes follow")
    values = np.frombuffer(data, dtype, offset=file.tell())
    return values.reshape(shape, order="F" if fortran else "C")
