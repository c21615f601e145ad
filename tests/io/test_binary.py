"""Numbers and bytes of a binary file, one after another, and never beyond its end."""

from __future__ import annotations

import struct

import pytest

from nacre.errors import FormatError
from nacre.io.binary import BinaryReader

DATA = struct.pack("<HIf", 7, 1 << 20, 0.5) + b"text"


def test_every_part_begins_where_the_last_one_ends() -> None:
    reader = BinaryReader(DATA, "a.bin")
    assert reader.take("<HI", "numbers") == (7, 1 << 20)
    assert reader.skip(4, "a number") == 6
    assert reader.bytes(4, "a text") == b"text"
    assert reader.position == len(DATA)
    assert BinaryReader(DATA, "a.bin", 6).take("<f", "a number") == (0.5,)


@pytest.mark.parametrize("length", [5, 1 << 70])
def test_what_is_not_there_is_named(length: int) -> None:
    reader = BinaryReader(DATA, "a.bin", 10)
    with pytest.raises(FormatError, match=r"a\.bin: ends within the text"):
        reader.bytes(length, "the text")
    assert reader.position == 10  # nothing was taken
    with pytest.raises(FormatError, match="ends within two numbers"):
        reader.take("<2I", "two numbers")
    assert reader.bytes(4, "the text") == b"text"
