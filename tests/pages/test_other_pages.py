"""Every second page, so that two processes share them: see test_pages."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.pages.pages import PAGES
from tests.pages.test_pages import names, run_as_typed


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES[::2], ids=names)
def test_lines_run_as_typed(page: Path) -> None:
    run_as_typed(page)
