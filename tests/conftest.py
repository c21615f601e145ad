"""What every test starts from: signals as in a terminal, and a folder for states of its own."""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Iterator
from typing import Any

import pytest

# Shells start what runs in the background with Ctrl-C ignored.
signal.signal(signal.SIGINT, signal.default_int_handler)
# As many processes as cores run tests: more threads would wait for one another.
os.environ.setdefault("OMP_NUM_THREADS", "1")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The files that take minutes come first: begun last, one would run alone."""
    items.sort(key=lambda item: not item.nodeid.startswith("tests/pages/"))


def pytest_collection_finish() -> None:
    """The thousands of tests stay for good: collections need not go through them again."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def usual_variant() -> Iterator[None]:
    """Leave Mitsuba as nacre starts it: what stays set would draw the next file's pictures."""
    yield
    mi = sys.modules.get("mitsuba")
    if mi is not None and mi.variant() is not None:
        from tests.variants import USUAL

        mi.set_variant(USUAL)


@pytest.fixture(autouse=True)
def fresh_session() -> Iterator[None]:
    """Leave no option of a command behind: tests run some commands without their group."""
    yield
    module = sys.modules.get("nacre.cli.session")
    if module is not None:
        module.begin()


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """Playwright's browser, or the test is skipped; a thread can have one only."""
    from tests.oracles.runners import browser
    from tests.targets.support import needs

    needs(browser.missing())
    with browser.launched() as opened:
        yield opened
