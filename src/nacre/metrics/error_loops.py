"""The compiled loop that compares texels."""

from __future__ import annotations

from typing import Any

from nacre.compile.numba_code import compiled


@compiled
def compare(truth: Any, other: Any, texels: Any, pairs: Any) -> None:
    """Add errors of values (b, n, 3) to squares per texel (b,), and to sums per pair (3, n).

    The sums are those of :class:`nacre.metrics.texture_errors.ErrorSums`: squared and absolute
    errors, and squared truth.
    """
    for texel in range(truth.shape[0]):
        total = 0.0
        for entry in range(truth.shape[1]):
            red, green, blue = (
                truth[texel, entry, 0],
                truth[texel, entry, 1],
                truth[texel, entry, 2],
            )
            r = other[texel, entry, 0] - red
            g = other[texel, entry, 1] - green
            b = other[texel, entry, 2] - blue
            square = r * r + g * g + b * b
            total += square
            pairs[0, entry] += square
            pairs[1, entry] += abs(r) + abs(g) + abs(b)
            pairs[2, entry] += red * red + green * green + blue * blue
        texels[texel] += total
