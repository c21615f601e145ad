"""A window for the viewer's pages."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.viewer.tab import Tab


@pytest.fixture
def tab(chromium: Any, tmp_path: Path) -> Iterator[Tab]:
    """A window that shows one page; at its end nothing may have gone wrong in it unseen."""
    with Tab(chromium, tmp_path) as opened:
        yield opened
