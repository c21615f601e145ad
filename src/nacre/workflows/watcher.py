"""Watchers, which are told about the progress of a run."""

from __future__ import annotations

from functools import cache

from nacre.runtime.progress import Progress


class Watcher:
    """Told about the progress of a run, by several threads at once; this one does nothing."""

    def dashboard(self, link: str) -> None:
        """The fits are carried out on a cluster with this dashboard."""

    def begin(self, materials: int) -> None:
        """So many materials will be fitted."""

    def start(self, name: str) -> Progress:
        """The fit of a material begins; the result is called with its progress."""
        return lambda stage, done, total, note: None

    def end(self, name: str, error: str | None) -> None:
        """A material is done, or has failed with an error, perhaps before it began."""


def begun(watcher: Watcher, name: str) -> Progress:
    """Progress that starts a material with its first report, not when it is queued."""
    started = cache(lambda: watcher.start(name))
    return lambda stage, done, total, note: started()(stage, done, total, note)
