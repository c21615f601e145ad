"""How work that takes a while reports how far it is."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, int, int, str], None]
"""Called as `progress(stage, done, total, note)`."""


def silent(stage: str, done: int, total: int, note: str) -> None:
    """Report nothing."""


def named(progress: Progress, name: str) -> Progress:
    """The same with a name in front of the stages."""
    return lambda stage, done, total, note: progress(f"{name}, {stage}", done, total, note)
