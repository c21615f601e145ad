"""The compiled loops of an adaptive binary range coder of whole numbers in bands.

Each number is told by yes and no: is it 0, is it 1, and so on. What came out before in like places
gives the probability of either, and a number costs the logarithms of them. The coder is the
carry-propagating one of Martin (1979), "Range encoding".
"""

from __future__ import annotations

from typing import Any

from nacre.compile.numba_code import compiled
from nacre.textures.rates.bands import BITS, FAR, NEAR, UNARY

LOW, RANGE, HELD, WAITING, PLACE = range(5)  # of the state
_TOP, _FULL = 1 << 24, (1 << 32) - 1
_FAST, _SLOW = 4, 7  # binary logarithms of how many numbers two estimates remember
_LEAST = 96  # of 65,536: no probability is less


@compiled
def _emit(state: Any, data: Any) -> None:
    low = state[LOW]
    if low < 0xFF000000 or low > _FULL:
        carry = low >> 32
        while state[WAITING] > 0:
            place = state[PLACE]
            if 0 <= place < data.shape[0]:
                data[place] = (state[HELD] + carry) & 0xFF
            state[PLACE] = place + 1
            state[HELD] = 0xFF
            state[WAITING] -= 1
        state[HELD] = (low >> 24) & 0xFF
    state[WAITING] += 1
    state[LOW] = (low & 0x00FFFFFF) << 8


@compiled
def _take(state: Any, data: Any) -> None:
    place = state[PLACE]
    byte = data[place] if place < data.shape[0] else 0
    state[LOW] = ((state[LOW] << 8) | byte) & _FULL
    state[PLACE] = place + 1


@compiled
def _coded(bit: Any, chance: Any, state: Any, data: Any, writing: Any) -> Any:
    """A bit, written, or read, whose probability of 1 is `chance` / 65,536."""
    bound = (state[RANGE] >> 16) * chance
    if writing:
        if bit:
            state[RANGE] = bound
        else:
            state[LOW] += bound
            state[RANGE] -= bound
    elif state[LOW] < bound:
        bit = 1
        state[RANGE] = bound
    else:
        bit = 0
        state[LOW] -= bound
        state[RANGE] -= bound
    while state[RANGE] < _TOP:
        state[RANGE] <<= 8
        if writing:
            _emit(state, data)
        else:
            _take(state, data)
    return bit


@compiled
def _adaptive(bit: Any, context: Any, chances: Any, state: Any, data: Any, writing: Any) -> Any:
    fast, slow, count = chances[context, 0], chances[context, 1], chances[context, 2]
    chance = min(max((fast + slow) >> 1, _LEAST), 65536 - _LEAST)
    bit = _coded(bit, chance, state, data, writing)
    target = 65535 if bit else 0
    chances[context, 0] = fast + (target - fast) // min(count + 2, 1 << _FAST)
    chances[context, 1] = slow + (target - slow) // min(count + 2, 1 << _SLOW)
    chances[context, 2] = min(count + 1, 1 << _SLOW)
    return bit


@compiled
def _size(value: Any, most: Any) -> Any:
    """The number of bits of a magnitude, at most `most`."""
    bits = 0
    while bits < most and value >= 1 << bits:
        bits += 1
    return bits


@compiled
def start(state: Any, data: Any, writing: Any) -> None:
    """Begin to write, or to read, `data`."""
    state[LOW], state[RANGE], state[HELD] = 0, _FULL, 0
    state[WAITING] = 0
    state[PLACE] = -1 if writing else 0  # the first byte that is written is always 0
    if writing:
        state[WAITING] = 1
    else:
        for _ in range(4):
            _take(state, data)


@compiled
def finish(state: Any, data: Any) -> None:
    """Write what is left, in as few bytes as tell it where zeros follow."""
    low, end = state[LOW], state[LOW] + state[RANGE]
    for bits in (24, 16, 8):
        rounded = ((low + (1 << bits) - 1) >> bits) << bits
        if rounded < end:
            state[LOW] = rounded
            break
    for _ in range(5):
        _emit(state, data)
    while state[PLACE] > 0 and data[min(state[PLACE], data.shape[0]) - 1] == 0:
        state[PLACE] -= 1


@compiled
def band(
    numbers: Any,
    beside: Any,
    coarser: Any,
    chances: Any,
    first: Any,
    state: Any,
    data: Any,
    writing: Any,
) -> None:
    """Write, or read, the whole numbers of a band, shape (channels, rows, columns).

    `beside` is an earlier band of the level, and `coarser` the same band of the level before;
    either may be empty. Contexts of the band begin at `first`.
    """
    channels, rows, columns = numbers.shape
    for c in range(channels):
        for y in range(rows):
            for x in range(columns):
                near = 0
                if x > 0:
                    near += 2 * abs(numbers[c, y, x - 1])
                if y > 0:
                    near += 2 * abs(numbers[c, y - 1, x])
                    if x > 0:
                        near += abs(numbers[c, y - 1, x - 1])
                    if x + 1 < columns:
                        near += abs(numbers[c, y - 1, x + 1])
                far = 0
                if coarser.size > 0:
                    up, left = min(y // 2, coarser.shape[1] - 1), min(x // 2, coarser.shape[2] - 1)
                    far += 2 * abs(coarser[c, up, left])
                if beside.size > 0:
                    up, left = min(y, beside.shape[1] - 1), min(x, beside.shape[2] - 1)
                    far += 2 * abs(beside[c, up, left])
                if c > 0:
                    far += 2 * abs(numbers[c - 1, y, x])
                if c > 1:
                    far += abs(numbers[c - 2, y, x])
                place = first + (_size(near, NEAR - 1) * FAR + _size(far, FAR - 1)) * (UNARY + BITS)
                value = numbers[c, y, x]
                size = abs(value)
                known = 0
                while known < UNARY:
                    more = 1 if size > known else 0
                    if not _adaptive(more, place + known, chances, state, data, writing):
                        break
                    known += 1
                if known == UNARY:
                    rest, bits = size - UNARY + 1, 1
                    while bits < BITS:
                        more = 1 if rest >> bits > 0 else 0
                        context = place + UNARY + bits
                        if not _adaptive(more, context, chances, state, data, writing):
                            break
                        bits += 1
                    found = 1
                    for k in range(bits - 1):
                        shift = bits - 2 - k
                        found = 2 * found + _coded((rest >> shift) & 1, 32768, state, data, writing)
                    known = found + UNARY - 1
                if known > 0:
                    negative = _coded(1 if value < 0 else 0, 32768, state, data, writing)
                    numbers[c, y, x] = -known if negative else known
                else:
                    numbers[c, y, x] = 0
