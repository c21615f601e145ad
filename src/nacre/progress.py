"""How work that takes a while tells how far it is."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, int, int, str], None]
"""Called as `progress(stage, done, total, note)`."""


def silent(stage: str, done: int, total: int, note: str) -> None:
    """Says nothing."""
