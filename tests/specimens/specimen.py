"""What is known of the files of one format, and damage that any file can suffer."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from random import Random
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]

NUMBERS = (0, -1, 1, 2, 3, 255, 2**15, 2**16 - 1, 2**31 - 1, 2**31, 2**32 - 1, 2**62, 2**63 - 1)
"""Integers at which sizes overflow or vanish."""
VALUES = (0.0, -0.0, -1.0, 1e-45, 1e-38, 1e-6, 1.0, 6e4, 1e10, 3.4e38, 1e300, math.inf, math.nan)
"""Floats at which formulas overflow or vanish."""


@dataclass(frozen=True)
class Specimen:
    """What is known of the files of one format.

    Parameters
    ----------
    name
        File name; its ending is the format's.
    files
        Makes whole files, small ones; once, as some take long.
    header
        How many bytes at the start are worth cutting one by one.
    sized
        Makes files in which one count is replaced by a given one that is never true.
    valued
        Makes files in which one value is replaced by a given one.
    rebuild
        Makes a file whose lengths and checksums agree, around contents that are out of the
        ordinary: damage that bytes alone would hardly find.
    text
        Whether files are text: cut between lines, a file may be a whole one.
    companions
        Other files of the set that a file belongs to.
    module
        Optional dependency that reading needs, if any.
    memory
        Bytes that reading may take whatever the length of the file, beside a multiple of it.
    """

    name: str
    files: Callable[[], list[bytes]]
    header: int
    sized: Callable[[int], Iterable[bytes]]
    valued: Callable[[float], Iterable[bytes]]
    rebuild: Callable[[bytes, Random], bytes]
    text: bool = False
    companions: Mapping[str, bytes] = field(default_factory=dict)
    module: str = ""
    memory: int = 16 << 20

    def __post_init__(self) -> None:
        object.__setattr__(self, "files", cache(self.files))


def packed(number: int, size: int) -> bytes:
    """The low bytes of an integer."""
    return (number % (1 << (8 * size))).to_bytes(size, "little")


def replaced(data: bytes, place: int, part: bytes) -> bytes:
    return data[:place] + part + data[place + len(part) :]


def odd_array(random: Random, shape: tuple[int, ...], dtype: str) -> Array:
    """Numbers of the interval (0, 1), some of them replaced by extreme ones."""
    generator = np.random.default_rng(random.getrandbits(32))
    with np.errstate(over="ignore", invalid="ignore"):
        array = np.asarray(generator.random(shape))
        if random.random() < 0.3:
            array[...] = random.choice(VALUES[:-2])
        for _ in range(random.choice((0, 0, 1, 3))):
            if array.size:
                array.flat[random.randrange(array.size)] = random.choice(VALUES)
        return array.astype(dtype)


def odd_json(random: Random, depth: int = 0) -> Any:
    """Something that JSON holds, of any kind."""
    choices: list[Any] = [None, True, "", "x" * 300, "a\nb", "\ud800", [], {}, *NUMBERS, *VALUES]
    if depth < 3:
        choices += [[odd_json(random, depth + 1)], {"kind": odd_json(random, depth + 1)}]
    return random.choice(choices)


def odd_shape(random: Random, rank: int) -> tuple[int, ...]:
    return tuple(random.choice((1, 1, 2, 3, 4, 6)) for _ in range(rank))


def mutated(data: bytes, random: Random) -> bytes:
    """A file with a few numbers overwritten, and parts cut, repeated or moved."""
    content = bytearray(data)
    for _ in range(random.choice((1, 1, 2, 4))):
        near = 256 if random.random() < 0.6 else len(content)
        place = random.randrange(max(1, min(near, len(content))))
        choice = random.random()
        if choice < 0.5:
            size = random.choice((1, 2, 4, 8))
            content[place : place + size] = packed(random.choice(NUMBERS), size)
        elif choice < 0.7:
            layout = random.choice(("<f", "<d"))
            value = random.choice(VALUES)
            value = value if layout == "<d" or not 3.5e38 < value < math.inf else math.inf
            part = struct.pack(layout, value)
            content[place : place + len(part)] = part
        elif choice < 0.8:
            del content[place : place + random.choice((1, 4, 8, 1 << 20))]
        elif choice < 0.9:
            content[place:place] = content[place : place + random.choice((1, 4, 8, 64))]
        elif content:
            content[place % len(content)] ^= 1 << random.randrange(8)
    return bytes(content)
