"""When two things hold the same."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from nacre.objects.content import mark, same


class Plain:
    """Attributes, and no way to compare."""

    def __init__(self, **attributes: Any) -> None:
        vars(self).update(attributes)


@dataclass(frozen=True)
class Held:
    """Compares its fields, of which one is an array."""

    values: Any


def zero() -> int:
    return 0


def one() -> int:
    return 1


SAME = [
    (1.5, 1.5),
    (math.nan, float("nan")),
    (np.array([1.0, math.nan]), np.array([1.0, math.nan])),
    ([np.zeros(2), {"a": (np.ones(1),)}], [np.zeros(2), {"a": (np.ones(1),)}]),
    (Plain(a=np.ones(2), b=Plain(c="d")), Plain(a=np.ones(2), b=Plain(c="d"))),
    (Held(np.ones(2)), Held(np.ones(2))),
    (zero, zero),
    (Plain, Plain),
    (math, math),
]
DIFFERENT = [
    (1.5, 1.25),
    (1, 1.0),
    (1, True),
    (np.zeros(2), np.zeros(2, np.float32)),
    (np.zeros(2), np.zeros((2, 1))),
    ((1,), [1]),
    ((1, 2), (1,)),
    ({"a": 1}, {"b": 1}),
    (Plain(a=np.ones(2)), Plain(a=np.zeros(2))),
    (Plain(a=1), Plain(b=1)),
    (Held(np.ones(2)), Held(np.zeros(2))),
    (zero, one),
    (Plain, Held),
    (math, np),
]


@pytest.mark.parametrize(("a", "b"), SAME)
def test_what_holds_the_same(a: Any, b: Any) -> None:
    assert same(a, b)
    assert hash(mark(a)) == hash(mark(b))


@pytest.mark.parametrize(("a", "b"), DIFFERENT)
def test_what_does_not(a: Any, b: Any) -> None:
    assert not same(a, b)
    assert not same(b, a)
