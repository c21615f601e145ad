"""What tests of exports share."""

from __future__ import annotations

from functools import cache

import pytest

from tests.oracles.runner import RUNNERS, Runner


def needs(missing: str | None) -> None:
    """Skip a test, with the name of what it lacks, where something is missing."""
    if missing:
        pytest.skip(f"{missing} is not installed")


@cache
def runner(name: str) -> Runner:
    """One of :data:`RUNNERS`, or the test is skipped."""
    made = RUNNERS[name]()
    needs(made.missing())
    return made
