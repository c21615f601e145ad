"""Progress of the command that runs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext

from rich.console import Console

from nacre.cli.display import Display, Line
from nacre.cli.session import session


@contextmanager
def hidden_progress() -> Iterator[None]:
    """A block in which the command shows no progress, as a question to the user needs."""
    display = session().display
    with display.hidden() if display is not None else nullcontext():
        yield


def progress(name: str, stage: str = "") -> Line:
    """A line of the display of the command that runs, with the stage that begins."""
    # Outside of a command there is no display.
    display = session().display or Display(name, Console(stderr=True), quiet=True)
    line = display.add(name)
    if stage:
        line(stage, 0, 1)
    return line
