"""A browser for the viewer's pages, and materials to show."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from studies.parity.runners import browser
from tests.export.support import needs
from tests.viewer.tab import Tab


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """Playwright's browser, or the test is skipped."""
    needs(browser.missing())
    with browser.launched() as opened:
        yield opened


@pytest.fixture
def tab(chromium: Any, tmp_path: Path) -> Iterator[Tab]:
    """A window that shows one page; at its end nothing may have gone wrong in it unseen."""
    with Tab(chromium, tmp_path) as opened:
        yield opened
