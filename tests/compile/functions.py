"""Functions that tests compile."""

from __future__ import annotations

import math

from nacre.compile.numba_code import compiled


@compiled
def double(x):
    for k in range(x.size):
        x[k] += x[k]


@compiled
def add(x, count, times, most, on):
    """What a function gets of numbers of every kind."""
    if on:
        for row in range(x.shape[0]):
            for column in range(x.shape[1]):
                x[row, column] = min(x[row, column] + count * times, most)


@compiled
def gamma(x):
    x[0] = math.gamma(x[0])
