"""Who hears how a run over a library goes on."""

from __future__ import annotations

from functools import cache

from nacre.runtime.progress import Progress


class Watcher:
    """Hears how a run goes on, from several threads at once. This one does nothing."""

    def dashboard(self, link: str) -> None:
        """The fits are carried out elsewhere; this page shows how."""

    def begin(self, materials: int) -> None:
        """So many will be fitted."""

    def start(self, name: str) -> Progress:
        """A material is begun; what is returned is called as its fit goes on."""
        return lambda stage, done, total, note: None

    def end(self, name: str, error: str | None) -> None:
        """A material is done, or has failed for a reason, maybe before it was begun."""


def begun(watcher: Watcher, name: str) -> Progress:
    """A material counts as started when the first is heard of it, not when it is queued."""
    started = cache(lambda: watcher.start(name))
    return lambda stage, done, total, note: started()(stage, done, total, note)
