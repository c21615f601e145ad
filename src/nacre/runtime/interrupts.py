"""Ctrl-C and SIGTERM at a convenient time."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager

_SIGNALS = signal.SIGINT, signal.SIGTERM


class Terminated(KeyboardInterrupt):
    """SIGTERM, which ends work as Ctrl-C does."""


@contextmanager
def terminable() -> Iterator[None]:
    """A block that SIGTERM ends by :class:`Terminated`, so that what was begun is cleaned up.

    Nothing changes where the process already treats SIGTERM in its own way.
    """
    own = threading.current_thread() is threading.main_thread()
    if not own or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:
        yield
        return

    def end(_number: int, _frame: object) -> None:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)  # a second one must not stop the cleaning up
        raise Terminated

    signal.signal(signal.SIGTERM, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """A block that Ctrl-C and SIGTERM do not interrupt: they take effect when the block is over."""
    if threading.current_thread() is not threading.main_thread():  # others are never interrupted
        yield
        return
    caught: list[int] = []
    previous = {
        number: signal.signal(number, lambda number, _: caught.append(number))
        for number in _SIGNALS
    }
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
    for first in caught[:1]:
        handler = previous[signal.Signals(first)]
        if callable(handler):
            handler(first, None)
        else:
            signal.raise_signal(first)
