"""Which tests run which lines, and how long each test takes."""

from __future__ import annotations

import hashlib
import json
import sys
import time
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

IMPORT = "import"
"""What runs before the first test: imports, and what test modules make when they are collected."""


class Record:
    """What is known of the tests.

    Parameters
    ----------
    path
        Of a JSON file that keeps it from one run to the next.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        empty: dict[str, Any] = {"seconds": {}, "lines": {}, "digests": {}, "source": ""}
        self._kept = json.loads(path.read_text()) if path.exists() else empty
        self.seconds: dict[str, float] = self._kept["seconds"]
        """Of each test that passes, by its node."""

    def missing(self, tests: Sequence[Path], sources: Sequence[Path]) -> list[Path]:
        """The test files that changed since they were recorded; all of them if a source did."""
        source = _digest(sources)
        if source != self._kept["source"]:
            self.seconds.clear()
            self._kept |= {"lines": {}, "digests": {}, "source": source}
        digests = self._kept["digests"]
        return [path for path in tests if digests.get(str(path)) != _digest([path])]

    def add(self, tests: Sequence[Path], sources: Sequence[Path]) -> None:
        """Run test files and keep what they cover of the sources."""
        import coverage

        digests = {str(path): _digest([path]) for path in tests}  # they may change meanwhile
        measured = coverage.Coverage(
            data_file=None, config_file=False, include=[str(path.resolve()) for path in sources]
        )
        recorder = _Recorder(measured)
        measured.start()
        measured.switch_context(IMPORT)
        arguments = ["-q", "-p", "no:cacheprovider", "-s", *map(str, tests)]
        pytest.main(arguments, plugins=[recorder])
        measured.stop()
        files = {str(path) for path in tests}
        for test in [test for test in self.seconds if test.partition("::")[0] in files]:
            del self.seconds[test]
        self.seconds.update(recorder.seconds)
        data = measured.get_data()
        root = Path.cwd()
        for path in data.measured_files():
            file = Path(path).relative_to(root).as_posix()
            lines: dict[str, list[str]] = self._kept["lines"].setdefault(file, {})
            for line, contexts in lines.items():
                lines[line] = [c for c in contexts if c.partition("::")[0] not in files]
            for line, contexts in data.contexts_by_lineno(path).items():
                lines[str(line)] = sorted({*lines.get(str(line), []), *contexts})
        self._kept["digests"] |= digests
        self._path.write_text(json.dumps(self._kept))

    def of_lines(self, file: str, first: int, last: int) -> set[str]:
        """The tests that run one of some lines, and :data:`IMPORT` if an import does."""
        lines = self._kept["lines"].get(file, {})
        return {context for line in range(first, last + 1) for context in lines.get(str(line), [])}

    def of_file(self, file: str) -> set[str]:
        """The tests that run any line of a file."""
        lines = self._kept["lines"].get(file, {})
        return {context for contexts in lines.values() for context in contexts}


class _Recorder:
    def __init__(self, measured: Any) -> None:
        self.seconds: dict[str, float] = {}
        self._measured = measured
        self._passed: dict[str, bool] = defaultdict(lambda: True)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        for name, module in list(sys.modules.items()):
            if name.startswith("nacre."):
                _forget(vars(module).values())
        self._measured.switch_context(item.nodeid)
        before = time.perf_counter()
        result = yield
        if self._passed[item.nodeid]:
            self.seconds[item.nodeid] = time.perf_counter() - before
        return result

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        self._passed[report.nodeid] &= report.passed


def _forget(values: Iterable[Any]) -> None:
    """Empty the caches of functions: a later test would not run their lines."""
    for value in list(values):
        clear = getattr(value, "cache_clear", None)
        if callable(clear) and getattr(value, "__module__", "").startswith(
            ("nacre.measured", "nacre.sampling", "nacre.io", "nacre.numerics", "nacre.geometry")
        ):
            clear()


def _digest(paths: Sequence[Path]) -> str:
    digest = hashlib.sha256()
    for path in paths:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
