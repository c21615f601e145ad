"""Progress on standard error: a live display on a terminal, now and then a line elsewhere."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text

DELAY = 0.7
"""Seconds before anything is shown on a terminal: shorter work needs no progress."""
EVERY = 30.0
"""Seconds before and between plain lines, in a log or a script that nobody watches."""
_LINES = 4
"""Most plain lines printed at a time."""


class Line:
    """Progress of one material or job, called as a :data:`nacre.runtime.progress.Progress`."""

    def __init__(self, display: Display, name: str) -> None:
        self._display, self.name = display, name
        self.stage, self.note = "", ""
        self.done, self.total = 0, 0
        self.began = time.monotonic()

    def __call__(self, stage: str, done: int, total: int, note: str = "") -> None:
        """Show that `done` of `total` steps of a stage are finished."""
        if stage != self.stage:
            now = time.monotonic()
            self._display.stage_ended(self, now - self.began)
            self.stage, self.began = stage, now
        self.done, self.total, self.note = done, total, note

    def parts(self, stage: str, total: int = 100) -> Callable[[float], None]:
        """A function that takes the finished fraction of a stage, from 0 to 1."""
        return lambda part: self(stage, round(part * total), total)

    def end(self) -> None:
        self._display.remove(self)

    def plain(self) -> str:
        parts = [f"{self.name}: {self.stage or 'starting'}"]
        if self.total > 1:
            parts[0] += f" {self.done:,}/{self.total:,}"
        return ", ".join([*parts, *([self.note] if self.note else [])])

    def cells(self) -> tuple[Any, ...]:
        """The line in columns: name, stage, bar, steps, time left, note."""
        bar = ProgressBar(max(self.total, 1), self.done, width=24)
        steps = f"{self.done:,}/{self.total:,}" if self.total > 1 else ""
        note = Text(self.note, no_wrap=True, overflow="ellipsis")
        return Text(self.name), self.stage or "starting", bar, steps, self._left(), note

    def _left(self) -> str:
        """Time left in the stage at its speed so far."""
        if not self.done or self.total <= 1:
            return "-:--:--"
        passed = time.monotonic() - self.began
        left = int(passed / self.done * max(0, self.total - self.done))
        return f"{left // 3600}:{left // 60 % 60:02d}:{left % 60:02d}"


class Display:
    """All lines of a command, or its title until there is one, shown by a thread.

    `quiet` shows nothing; `verbose` prints how long every stage took.
    """

    def __init__(
        self, title: str, console: Console, *, quiet: bool = False, verbose: bool = False
    ) -> None:
        self._console, self._quiet, self._verbose = console, quiet, verbose
        # With FORCE_COLOR, which Jupyter sets, rich takes a pipe for a terminal.
        self._is_terminal = console.is_terminal and console.file.isatty()
        self._lock = threading.Lock()
        self._lines = [Line(self, title)]
        self._untouched, self._hidden = True, False
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="progress", daemon=True)
        self._live: Live | None = None

    def __enter__(self) -> Display:
        if not self._quiet:
            self._thread.start()
        return self

    def __exit__(self, *error: Any) -> None:
        self._stop.set()
        if self._thread.is_alive():
            self._thread.join()
        self.clear()
        if self._verbose and not error[0]:
            with self._lock:
                lines = list(self._lines)
            for line in lines:
                self.stage_ended(line, time.monotonic() - line.began)

    def add(self, name: str) -> Line:
        line = Line(self, name)
        with self._lock:
            if self._untouched:
                self._lines.clear()
                self._untouched = False
            self._lines.append(line)
        return line

    def remove(self, line: Line) -> None:
        with self._lock:
            if line in self._lines:
                self._lines.remove(line)

    def clear(self) -> None:
        """Make room for printed text; the display returns while work goes on."""
        with self._lock:
            if self._live is not None:
                self._live.stop()
                self._live = None

    @contextmanager
    def hidden(self) -> Iterator[None]:
        with self._lock:
            self._hidden = True
        self.clear()
        try:
            yield
        finally:
            self._hidden = False

    def stage_ended(self, line: Line, seconds: float) -> None:
        """Print how long a stage took, if verbose."""
        if self._verbose and line.stage:
            self.clear()
            text = f"{line.name}: {line.stage}: {seconds:.2f} s"
            self._console.print(text, style="dim", markup=False)

    def _run(self) -> None:
        wait = DELAY if self._is_terminal else EVERY
        while not self._stop.wait(wait):
            wait = 0.125 if self._is_terminal else EVERY
            with self._lock:
                if self._hidden:
                    continue
                if self._is_terminal:
                    self._refresh()
                else:
                    self._print()

    def _refresh(self) -> None:
        grid = Table.grid(padding=(0, 1))
        for _ in range(5):
            grid.add_column(no_wrap=True)
        grid.add_column()  # the note gives way where the terminal is narrow
        room = max(2, self._console.height - 2)
        for line in self._lines[:room]:
            grid.add_row(*line.cells())
        if len(self._lines) > room:
            grid.add_row(f"and {len(self._lines) - room} more")
        if self._live is None:
            self._live = Live(console=self._console, transient=True, auto_refresh=False)
            self._live.start()
        self._live.update(grid, refresh=True)

    def _print(self) -> None:
        """Print what is in work."""
        for line in self._lines[:_LINES]:
            self._console.print(line.plain(), markup=False)
        if len(self._lines) > _LINES:
            self._console.print(f"and {len(self._lines) - _LINES} more", markup=False)
