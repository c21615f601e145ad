"""Checks by name, tests of pytest from them, and what checks share."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any, TypeAlias, TypeVar

import numpy as np

from nacre.array import Floats
from nacre.errors import NacreError, did_you_mean
from nacre.geometry import join, uniform_hemisphere

Check: TypeAlias = tuple[str, Callable[[], None]]
"""What is checked, in words, and the function that raises AssertionError where it is not so."""
Checks: TypeAlias = Iterator[Check]

_T = TypeVar("_T")
_Contract = Callable[[_T], None]


def parametrize(
    *checks: Iterable[Check], expected_failures: Mapping[str, str] | None = None
) -> Any:
    """A decorator of pytest that runs a test function for each check, as its argument `check`.

    Parameters
    ----------
    checks
        From the functions of :mod:`nacre.testing`.
    expected_failures
        Names of checks that fail, each with the reason. Such a test is expected to fail, and is an
        error once it passes.

    Raises
    ------
    NacreError
        If a name among the expected failures is not that of a check.
    """
    import pytest

    reasons = dict(expected_failures or {})
    named = [check for some in checks for check in some]
    names = {name for name, _ in named}
    for name in reasons:
        if name not in names:
            raise NacreError(f"{name}: is not a check{did_you_mean(name, names)}")
    cases = [
        pytest.param(
            function,
            id=name.replace(" ", "-"),
            marks=[pytest.mark.xfail(reason=reasons[name], strict=True, raises=AssertionError)]
            if name in reasons
            else [],
        )
        for name, function in named
    ]
    return pytest.mark.parametrize("check", cases)


def under(heading: str, checks: Iterable[Check]) -> Checks:
    """The same checks with a heading before their names: "heading: name"."""
    return ((f"{heading}: {name}", function) for name, function in checks)


class Contracts(dict[str, "_Contract[Any]"]):
    """Functions of one object, by what they check; a module lists its own with :meth:`add`."""

    def add(self, function: _Contract[_T]) -> _Contract[_T]:
        """List a function under its name in words."""
        self[function.__name__.strip("_").replace("_", " ")] = function
        return function

    def of(self, made: Callable[[], Any]) -> Checks:
        """All of them on what a function makes, which is made with the first."""
        once = functools.cache(made)
        for name, function in self.items():
            yield name, functools.partial(_run, function, once)


def _run(function: _Contract[Any], made: Callable[[], Any]) -> None:
    function(made())


def maker(given: Any, kind: type) -> Callable[[], Any]:
    """A function that gives an object; `given` is that object, or such a function."""
    return (lambda: given) if isinstance(given, kind) else given


def refused(
    kind: type[Exception] | tuple[type[Exception], ...],
    function: Callable[..., Any],
    *arguments: Any,
    words: str = "",
) -> Exception:
    """The error of a kind that a call raises.

    Raises AssertionError if there is none, or its message does not have the words, a pattern.
    """
    found: Exception | None = None
    try:
        function(*arguments)
    except kind as error:
        found = error
    assert found is not None, f"{getattr(function, '__name__', function)} raised no error"
    assert re.search(words, str(found)), f"the message {str(found)!r} lacks {words!r}"
    return found


def pairs(count: int = 4000) -> tuple[Floats, Floats]:
    """Random directions above the horizon, float32 of shape (count, 3)."""
    u = np.random.default_rng(7).random((4, count))
    first, second = (join(uniform_hemisphere(*u[k : k + 2])) for k in (0, 2))
    return first.astype(np.float32), second.astype(np.float32)


def relative_error(found: Floats, expected: Floats) -> Floats:
    """Errors over the larger of what is expected and 1 % of its mean."""
    size = np.abs(expected)
    return np.asarray(np.abs(found - expected) / np.maximum(size, 0.01 * size.mean() + 1e-30))
