"""Tables that are nothing but numbers after a header: their length and values, checked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.errors import FormatError

LARGEST = float(np.finfo(np.float32).max)  # largest value of a table: they are kept as float32


def read_values(
    data: bytes, where: str, contents: str, count: int, types: Sequence[str], offset: int = 0
) -> npt.NDArray[Any]:
    """The numbers that fill a file from an offset to its end: shape (count,), read-only, finite.

    The length of `data` tells which of the `types`, by NumPy's names, they have. A
    :class:`FormatError` starts with `where`, calls them `contents`, and says that the length fits
    no type or a value is not finite as float32.
    """
    lengths = {offset + count * np.dtype(name).itemsize: name for name in types}
    if len(data) not in lengths:
        whole = offset + count * np.dtype(types[0]).itemsize
        problem = "is cut short" if len(data) < whole else "has trailing bytes"
        found = f"{len(data)} bytes, but {contents} take {' or '.join(map(str, lengths))}"
        raise FormatError(f"{where}: {found}; the file {problem} or is something else")
    values = np.frombuffer(data, lengths[len(data)], offset=offset)
    hint = "download the file again"
    if values.dtype.itemsize == 2:
        hint += f", or one of float32: float16 ends at {np.finfo(np.float16).max:.0f}"
    check_finite(values, f"{where}: values", hint)
    return values


def check_finite(
    values: npt.NDArray[np.floating], where: str, hint: str, largest: float = LARGEST
) -> None:
    """Refuse values that are larger than a bound, infinite or not a number.

    The :class:`FormatError` starts with `where`, the file's path and the name of the values, and
    ends with a hint about what to do.
    """
    bound = min(largest, float(np.finfo(values.dtype).max))
    if not (values.min() >= -bound and values.max() <= bound):  # also of NaN
        raise FormatError(f"{where}: some are not finite; {hint}")
