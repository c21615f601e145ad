"""Long work that always takes the same loops in the same order, resumed by taking them again."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import TracebackType
from typing import Any

from nacre.runtime.interrupts import uninterrupted
from nacre.runtime.store import SAVE_EVERY, Store


@dataclass
class _Loop:
    step: int
    state: Callable[[], Any]


class Journal:
    """What loops of one piece of work have found so far, kept by a store.

    Work that is resumed takes all its loops again: those that were over end at once with what they
    found, and the one that was not goes on where it was. What lies between is repeated: it should
    be quick, and depend on nothing but what loops found. Everything is saved every `seconds`, and
    when an interrupt leaves the `with` block of the journal; without a store, nothing is.

    A :class:`NacreError` says that the state belongs to other work, or is damaged.
    """

    def __init__(
        self, store: Store | None = None, name: str = "", seconds: float = SAVE_EVERY
    ) -> None:
        self._store, self._name, self._seconds = store or Store(None), name, seconds
        self._kept: list[Any] = []
        self._taken: list[_Loop] = []
        if (kept := self._store.load(name)) is not None:
            with self._store.readable(name):
                self._kept = list(kept["loops"])

    def __enter__(self) -> Journal:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: object, trace: TracebackType | None
    ) -> None:
        if kind is not None and issubclass(kind, KeyboardInterrupt):
            with uninterrupted():
                self._save()

    def steps(
        self,
        count: int,
        take: Callable[[int], None],
        state: Callable[[], Any],
        restore: Callable[[Any], None],
    ) -> Iterator[int]:
        """Take the steps of the next loop, from the first that has not been; Ctrl-C waits for one.

        Gives the number of steps taken, after each. `take` is called with the number of a step,
        `state` returns what the steps have found so far, and `restore` brings it back.
        """
        place, first = len(self._taken), 0
        if place < len(self._kept):
            kept = self._kept[place]
            with self._store.readable(self._name):
                first = int(kept["step"])
                if not 0 <= first <= count:
                    raise ValueError(f"step {first} of {count}")
                restore(kept["state"])
        loop = _Loop(first, state)
        self._taken.append(loop)
        for step in range(first, count):
            with uninterrupted():
                take(step)
                loop.step = step + 1
                if self._store.due(self._seconds):
                    self._save()
            yield step + 1
        found = state()
        loop.state = lambda: found

    def once(self, compute: Callable[[], Any]) -> Any:
        """What a loop of one step computes: a tree that a store can hold."""
        found: list[Any] = []
        for _ in self.steps(1, lambda _: found.append(compute()), lambda: found, found.extend):
            pass
        return found[0]

    def _save(self) -> None:
        """Keep the loops taken, and those of an earlier process that come after them."""
        loops = [{"step": loop.step, "state": loop.state()} for loop in self._taken]
        self._store.save({"loops": loops + self._kept[len(loops) :]}, self._name)
