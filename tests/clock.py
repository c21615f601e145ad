"""A plugin of pytest for a run that has to end in time.

Tests that a change reaches come first, the nearest before the others; then the rest, in an order
that turns with the commit, so that runs that end early reach other tests each time. Tests that
have not begun in time are listed, and are no failure.

    python -m pytest -p tests.clock --until 1790000000 --since HEAD~3
"""

from __future__ import annotations

import hashlib
import subprocess
import time
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from tests.layers import reached

_LATE = "not reached"


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("clock")
    group.addoption("--until", type=float, default=float("inf"), help="seconds since 1970")
    group.addoption("--since", default="", help="revision before the change; empty if unknown")


def git(root: Path, *words: str) -> list[str]:
    """Lines that git prints; none where it fails, as outside a repository."""
    done = subprocess.run(["git", *words], cwd=root, capture_output=True, text=True)
    return done.stdout.splitlines() if done.returncode == 0 else []


def pytest_configure(config: pytest.Config) -> None:
    """What the process that starts the others works out once."""
    if hasattr(config, "workerinput"):
        return
    root, since = config.rootpath, config.getoption("--since")
    changed = git(root, "diff", "--name-only", since, "HEAD") if since else []
    distances = reached(root, changed) if changed else {}
    config.clock = distances, "".join(git(root, "rev-parse", "HEAD"))  # type: ignore[attr-defined]


@pytest.hookimpl(optionalhook=True)
def pytest_configure_node(node: Any) -> None:
    """Hand the order to a process of xdist."""
    node.workerinput["clock"] = node.config.clock


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: Any, items: list[pytest.Item]) -> None:
    """Files in the order in which they should run."""
    distances, commit = getattr(config, "workerinput", {}).get("clock") or config.clock

    def place(item: pytest.Item) -> tuple[float, str]:
        file = item.nodeid.partition("::")[0]
        turned = hashlib.sha256(f"{commit} {file}".encode()).hexdigest()
        return distances.get(file, float("inf")), turned

    items.sort(key=place)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Begin no test once the time is over."""
    if time.time() > item.config.getoption("--until"):
        pytest.skip(_LATE)


def pytest_report_teststatus(report: Any) -> tuple[str, str, str] | None:
    """Tests that were not reached are counted apart from those that lack something."""
    late = report.skipped and isinstance(report.longrepr, tuple)
    return (_LATE, "", "") if late and report.longrepr[2] == f"Skipped: {_LATE}" else None


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """List what was not reached, by file."""
    late = terminalreporter.stats.get(_LATE, [])
    if not late:
        return
    files = Counter(report.nodeid.partition("::")[0] for report in late)
    terminalreporter.section(f"{len(late)} tests in {len(files)} files were not reached in time")
    for file, count in sorted(files.items()):
        terminalreporter.line(f"{count:6} {file}")
