"""Progress of a run over several materials: one line on the whole, one on each in work."""

from __future__ import annotations

import threading

from nacre.cli.progress import Line, progress
from nacre.cli.report import aside
from nacre.runtime.progress import Progress
from nacre.workflows import Watcher


class RunWatcher(Watcher):
    """Shows how a run goes on.

    Parameters
    ----------
    title
        Shown before the counts of the whole run.
    """

    def __init__(self, title: str) -> None:
        self._lock = threading.Lock()
        self._lines: dict[str, Line] = {}
        self._whole = progress(title)
        self._total = self._done = self._failed = 0
        self._whole("looking for what has changed", 0, 0)

    def dashboard(self, link: str) -> None:
        """See :class:`nacre.workflows.Watcher`."""
        aside(f"dashboard: {link}")

    def begin(self, materials: int) -> None:
        """See :class:`nacre.workflows.Watcher`."""
        self._total = materials
        self._update()

    def start(self, name: str) -> Progress:
        """See :class:`nacre.workflows.Watcher`."""
        line = progress(name)
        with self._lock:
            self._lines[name] = line
            self._update()
        return line

    def end(self, name: str, error: str | None) -> None:
        """See :class:`nacre.workflows.Watcher`."""
        with self._lock:
            if line := self._lines.pop(name, None):
                line.end()
            self._done += error is None
            self._failed += error is not None
            self._update()

    def _update(self) -> None:
        if self._total == 1:  # the line of the material says it all
            self._whole.end()
        counts = f"{len(self._lines)} running, {self._failed} failed"
        self._whole("fitted", self._done + self._failed, self._total, counts)
