"""Progress on standard error: a live display on a terminal, plain lines elsewhere."""

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
"""Seconds of work before anything is printed: what is over sooner needs no progress."""
EVERY = 10.0
"""Seconds between plain lines while a stage goes on."""
_LINES = 4
"""Plain lines that are printed at a time."""


class Line:
    """Progress of one material or job; called as :data:`nacre.runtime.progress.Progress`."""

    def __init__(self, display: Display, name: str) -> None:
        self._display, self.name = display, name
        self.stage, self.note = "", ""
        self.done, self.total = 0, 0
        self.began = time.monotonic()
        self.printed: str | None = None

    def __call__(self, stage: str, done: int, total: int, note: str = "") -> None:
        """Show that `done` of `total` steps of a stage are finished."""
        if stage != self.stage:
            now = time.monotonic()
            self._display.stage_ended(self, now - self.began)
            self.stage, self.began = stage, now
        self.done, self.total, self.note = done, total, note

    def parts(self, stage: str, total: int = 100) -> Callable[[float], None]:
        """What to call with how much of a stage is done, from 0 to 1."""
        return lambda part: self(stage, round(part * total), total)

    def end(self) -> None:
        """Take the line off the display."""
        self._display.remove(self)

    def plain(self) -> str:
        """The line as text."""
        parts = [f"{self.name}: {self.stage or 'starting'}"]
        if self.total > 1:
            parts[0] += f" {self.done:,}/{self.total:,}"
        return ", ".join([*parts, *([self.note] if self.note else [])])

    def cells(self) -> tuple[Any, ...]:
        """The line in columns: name, stage, bar, steps, time left, note."""
        bar = ProgressBar(max(self.total, 1), self.done, width=24)
        steps = f"{self.done:,}/{self.total:,}" if self.total > 1 else ""
        return Text(self.name), self.stage or "starting", bar, steps, self._left(), Text(self.note)

    def _left(self) -> str:
        """Time that the stage still takes if it goes on as so far."""
        if not self.done or self.total <= 1:
            return "-:--:--"
        passed = time.monotonic() - self.began
        left = int(passed / self.done * max(0, self.total - self.done))
        return f"{left // 3600}:{left // 60 % 60:02d}:{left % 60:02d}"


class Display:
    """All lines of a command, shown by a thread of its own; the title until there is one.

    `quiet` shows nothing, `verbose` prints how long every stage took.
    """

    def __init__(
        self, title: str, console: Console, *, quiet: bool = False, verbose: bool = False
    ) -> None:
        self._console, self._quiet, self._verbose = console, quiet, verbose
        # FORCE_COLOR, which Jupyter sets, has rich take a pipe for a terminal.
        self._is_terminal = console.is_terminal and console.file.isatty()
        self._lock = threading.Lock()
        self._lines = [Line(self, title)]
        self._untouched, self._hidden = True, False
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="progress", daemon=True)
        self._live: Live | None = None
        self._last = time.monotonic()

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
        """A line for one material or job."""
        line = Line(self, name)
        with self._lock:
            if self._untouched:
                self._lines.clear()
                self._untouched = False
            self._lines.append(line)
        return line

    def remove(self, line: Line) -> None:
        """Take a line off the display."""
        with self._lock:
            if line in self._lines:
                self._lines.remove(line)

    def clear(self) -> None:
        """Make room for what is printed; the display comes back as work goes on."""
        with self._lock:
            if self._live is not None:
                self._live.stop()
                self._live = None

    @contextmanager
    def hidden(self) -> Iterator[None]:
        """A block in which nothing is shown, as a question to the user needs."""
        with self._lock:
            self._hidden = True
        self.clear()
        try:
            yield
        finally:
            self._hidden = False

    def stage_ended(self, line: Line, seconds: float) -> None:
        """Print how long a stage took, if that is wanted."""
        if self._verbose and line.stage:
            self.clear()
            text = f"{line.name}: {line.stage}: {seconds:.2f} s"
            self._console.print(text, style="dim", markup=False)

    def _run(self) -> None:
        wait = DELAY
        while not self._stop.wait(wait):
            wait = 0.125 if self._is_terminal else 1.0
            with self._lock:
                if self._hidden:
                    continue
                if self._is_terminal:
                    self._refresh()
                else:
                    self._print()

    def _refresh(self) -> None:
        grid = Table.grid(padding=(0, 1))
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
        """Lines whose stage is new; all of them when none was printed for a while."""
        now = time.monotonic()
        chosen = [line for line in self._lines if line.printed != line.stage]
        if not chosen and now - self._last >= EVERY:
            chosen = self._lines
        for line in chosen[:_LINES]:
            self._console.print(line.plain(), markup=False)
            line.printed, self._last = line.stage, now
        if len(chosen) > _LINES:
            self._console.print(f"and {len(chosen) - _LINES} more", markup=False)
            for line in chosen:
                line.printed = line.stage
