"""Lists of strings of variable length in HDF5 files, checked before HDF5 reads them.

HDF5 takes as much memory as such a string claims before it looks for the string, copies as much as
there is, and never leaves a heap in which an object claims no length. Layouts are those of the HDF5
file format specification: the attribute message (IV.A.2.m) and the global heap (III.E).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

_HEAP = b"GCOL"
_VARIABLE_LENGTH = 9  # class of a datatype
_MOST = 4096  # strings that a file may list; networks have two a layer


def count_strings(data: bytes, name: str) -> int:
    """How many strings of variable length the attributes of a name list in the content of a file.

    Raises ValueError if an attribute, a string or a heap is not whole, or there are more than 4096
    strings.
    """
    found = 0
    heaps: dict[int, dict[int, int]] = {}
    try:
        for length, heap, index in _strings(data, name.encode() + b"\0"):
            found += 1
            if found > _MOST:
                raise ValueError(f"attributes '{name}' hold more than {_MOST} strings")
            if length and heaps.setdefault(heap, {}).setdefault(index, length) != length:
                raise ValueError(f"attributes '{name}' claim two lengths of one string")
        for heap, strings in heaps.items():
            _check_heap(data, heap, strings)
    except (struct.error, IndexError) as error:
        raise ValueError(f"an attribute '{name}' is not whole") from error
    return found


def _strings(data: bytes, name: bytes) -> Iterator[tuple[int, int, int]]:
    """Length, address of the heap and number there of every string in attributes of a name."""
    at = data.find(name)
    while at >= 0:
        for version, start in ((data[at - 8], at - 8), (data[at - 9], at - 9)):
            if start >= 0 and (version in (1, 2) if start == at - 8 else version == 3):
                yield from _listed(data, start, at, 8 if version == 1 else 1)
        at = data.find(name, at + 1)


def _listed(data: bytes, start: int, at: int, align: int) -> Iterator[tuple[int, int, int]]:
    """The strings that one attribute lists; none if its values are of another kind."""
    sizes = struct.unpack_from("<3H", data, start + 2)
    kind, space, place = (
        at + sum(size + -size % align for size in sizes[:count]) for count in (1, 2, 3)
    )
    if data[kind] & 15 != _VARIABLE_LENGTH:
        return
    if struct.unpack_from("<I", data, kind + 4) != (16,) or data[space + 1] != 1:
        raise ValueError("strings are not in a list")
    (count,) = struct.unpack_from("<Q", data, space + (8 if data[space] == 1 else 4))
    if count > (len(data) - place) // 16:
        raise ValueError("a list of strings holds less than its shape says")
    yield from struct.iter_unpack("<IQI", memoryview(data)[place : place + 16 * count])


def _check_heap(data: bytes, heap: int, strings: dict[int, int]) -> None:
    """Refuse a heap that does not hold strings of given lengths, by number, or that is circular."""
    if data[heap : heap + 4] != _HEAP:
        raise ValueError("a string is in no heap")
    end = heap + int.from_bytes(data[heap + 8 : heap + 16], "little")
    if end > len(data):
        raise ValueError("its heap of strings is damaged")
    place, missing = heap + 16, dict(strings)
    while place + 16 <= end:
        index = int.from_bytes(data[place : place + 2], "little")
        size = int.from_bytes(data[place + 8 : place + 16], "little")
        step = 16 + size + -size % 8 if index else size
        if step < 16 or place + step > end or missing.pop(index, size) != size:
            raise ValueError("its heap of strings is damaged")
        place += step
    if missing:
        raise ValueError("its heap of strings lacks some")
