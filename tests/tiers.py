"""The two tiers of tests: what runs always, and further cases of the same, marked slow."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable
from typing import Any

import pytest


def tiered(cases: Iterable[Any], always: Container[Any] | Callable[[Any], bool]) -> list[Any]:
    """Cases for `pytest.mark.parametrize` or `params`, of which some run always.

    Parameters
    ----------
    cases
        Values of one parameter, or tuples of several.
    always
        Those that run always, or a function that tells; the others are marked slow.
    """
    first = always if callable(always) else always.__contains__
    found = []
    for case in cases:
        values = case if isinstance(case, tuple) else (case,)
        found.append(case if first(case) else pytest.param(*values, marks=pytest.mark.slow))
    assert any(not isinstance(case, type(pytest.param())) for case in found), "no case runs always"
    return found
