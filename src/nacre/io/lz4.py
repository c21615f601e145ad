"""Blocks packed with LZ4, as its "Block Format Description" has them."""

from __future__ import annotations


def unpacked_block(data: bytes, length: int) -> bytes:
    """The bytes of one block, of a length that is known; a ValueError says that it has others."""
    out = bytearray()
    place = 0
    try:
        while place < len(data):
            token = data[place]
            literals, place = _length(data, place + 1, token >> 4)
            if literals > len(data) - place or literals > length - len(out):
                raise ValueError("holds more than it should")
            out += data[place : place + literals]
            place += literals
            if place == len(data):
                break
            distance = data[place] | data[place + 1] << 8
            count, place = _length(data, place + 2, token & 15)
            count += 4
            if not 0 < distance <= len(out) or count > length - len(out):
                raise ValueError("repeats what it does not hold")
            start = len(out) - distance
            while count > 0:  # what is repeated may reach into the repetition
                part = out[start : start + count]
                out += part
                start += len(part)
                count -= len(part)
    except IndexError as error:
        raise ValueError("ends too early") from error
    if len(out) != length:
        raise ValueError(f"holds {len(out)} of {length} bytes")
    return bytes(out)


def _length(data: bytes, place: int, length: int) -> tuple[int, int]:
    """A length whose first four bits are known, and the place behind it."""
    if length == 15:
        while (byte := data[place]) == 255:
            length, place = length + 255, place + 1
        length, place = length + byte, place + 1
    return length, place
