"""Tests of mutants, each in a process of its own, forked from one that has everything imported."""

from __future__ import annotations

import contextlib
import gc
import importlib
import importlib.machinery
import json
import os
import resource
import select
import shutil
import signal
import sys
import tempfile
import time
import types
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from lab.studies.mutants.operators import Mutant

Tests = Sequence[tuple[str, float]]
"""Nodes and the seconds that they take."""

_LIBRARIES = (
    "numpy", "scipy.optimize", "scipy.interpolate", "scipy.spatial", "scipy.special", "numba",
    "llvmlite.binding", "h5py", "safetensors.numpy", "click", "rich.console", "PIL",
)  # fmt: skip
_GRACE = 30.0  # seconds that any test may take, beside eight times those that it took
_START = 150.0  # seconds to collect the tests of a module that is imported
_MEMORY = 6 << 30  # that a mutant may take beside what its process starts with


class NotReplaceableError(Exception):
    """A mutant that must be imported: it is not within a function."""


def attempt(work: Callable[[Callable[[str], None]], None], seconds: dict[str, float]) -> list[str]:
    """Run something in a forked process.

    Parameters
    ----------
    work
        Told how to write a line about what it does: "run NODE", "failed NODE", "done".
    seconds
        Of each test.

    Returns
    -------
    list of str
        Lines it wrote; the last one is "timeout" if a test took too long, "crash" if it ended.
    """
    read, write = os.pipe()
    home = tempfile.mkdtemp(prefix="mutant-")
    sys.stdout.flush()
    child = os.fork()
    if not child:
        os.close(read)
        _settle(home)

        def tell(line: str) -> None:
            os.write(write, f"{line}\n".encode())

        try:
            work(tell)
        except NotReplaceableError:
            tell("import")
        except BaseException as error:  # whatever a mutant raises when it is imported
            tell(f"failed {type(error).__name__}")
        os._exit(0)
    os.close(write)
    lines, rest = [], b""
    deadline = time.monotonic() + _START
    while True:
        ready, _, _ = select.select([read], [], [], max(deadline - time.monotonic(), 0.0))
        if not ready:
            lines.append("timeout")
            break
        data = os.read(read, 1 << 16)
        if not data:
            lines.append("crash")
            break
        *whole, rest = (rest + data).split(b"\n")
        lines += [line.decode() for line in whole]
        if whole:
            took = seconds.get(lines[-1].partition(" ")[2], 2.0)
            deadline = time.monotonic() + _GRACE + 8.0 * took
        if lines and lines[-1].partition(" ")[0] in {"done", "import", "failed"}:
            break
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)
    with contextlib.suppress(ProcessLookupError):
        os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    os.close(read)
    shutil.rmtree(home, ignore_errors=True)
    return lines


def _settle(home: str) -> None:
    """What a forked process may touch: a folder of its own, some memory, no terminal."""
    os.setsid()
    null = os.open(os.devnull, os.O_RDWR)
    for descriptor in (0, 1, 2):
        os.dup2(null, descriptor)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + _MEMORY, used + _MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    os.environ["TMPDIR"] = home
    tempfile.tempdir = home


def verdict(lines: list[str]) -> tuple[str, str]:
    """What came of it ("killed", "survived", "timeout" or "import"), and the test that tells."""
    last, _, node = lines[-1].partition(" ")
    running = next((line[4:] for line in reversed(lines) if line.startswith("run ")), "")
    if last in {"failed", "crash"}:
        return "killed", node or running
    if last == "timeout":
        return "timeout", running
    return ("import", "") if last == "import" else ("survived", "")


class Imported:
    """Mutants that are imported in place of their module, by processes without nacre."""

    def __init__(self) -> None:
        for name in _LIBRARIES:
            importlib.import_module(name)

    def run(self, mutant: Mutant | None, source: str, tests: Tests) -> tuple[str, str]:
        """Whether a test fails; with the code as it is, if there is no mutant."""

        def work(tell: Callable[[str], None]) -> None:
            if mutant:
                _replace_module(mutant, source)
            nodes = [node for node, _ in tests]
            reporter = _Reporter(tell, nodes)
            pytest.main(["-q", "-x", "-s", "-p", "no:cacheprovider", *nodes], plugins=[reporter])
            tell("done" if reporter.ran else "failed collection")

        return verdict(attempt(work, dict(tests)))


def _replace_module(mutant: Mutant, source: str) -> None:
    place = str(Path(mutant.file).resolve())
    usual = importlib.machinery.SourceFileLoader.get_code

    def get_code(self: Any, fullname: str) -> Any:
        if self.path != place:
            return usual(self, fullname)
        return compile(mutant.applied(source), place, "exec", dont_inherit=True)

    importlib.machinery.SourceFileLoader.get_code = get_code


class _Reporter:
    def __init__(self, tell: Callable[[str], None], nodes: Sequence[str]) -> None:
        self.ran = 0
        self._tell = tell
        self._order = {node: index for index, node in enumerate(nodes)}

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        items.sort(key=lambda item: self._order.get(item.nodeid, 0))

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        self.ran += 1
        self._tell(f"run {nodeid}")

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            self._tell(f"failed {report.nodeid}")


class Warm:
    """Mutants within functions: the code of the functions is replaced in a process that has
    collected all tests.

    Parameters
    ----------
    run
        Called once all tests are there, with this object.
    """

    def __init__(self, run: Callable[[Warm], None]) -> None:
        self._run = run
        self._items: dict[str, pytest.Item] = {}
        self._functions: dict[str, list[types.FunctionType]] = defaultdict(list)
        self._failed: list[str] = []

    def collect(self, paths: Iterable[str]) -> None:
        """Collect the tests, and run; ends the process where that cannot be done."""
        if pytest.main(["-q", "-s", "-p", "no:cacheprovider", *paths], plugins=[self]):
            os._exit(1)

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        self._items = {item.nodeid: item for item in session.items}
        gc.unfreeze()
        for found in gc.get_objects():
            if type(found) is types.FunctionType:  # isinstance would ask deprecated objects
                self._functions[found.__code__.co_filename].append(found)
        gc.freeze()
        self._run(self)
        return True

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            self._failed.append(report.nodeid)

    def run(self, mutant: Mutant | None, source: str, tests: Tests) -> tuple[str, str]:
        """Whether a test fails; with the code as it is, if there is no mutant."""

        def work(tell: Callable[[str], None]) -> None:
            if mutant:
                self._replace_functions(mutant, source)
            items = [self._items[node] for node, _ in tests if node in self._items]
            for item, following in zip(items, [*items[1:], None], strict=True):
                tell(f"run {item.nodeid}")
                item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
                if self._failed:
                    tell(f"failed {item.nodeid}")
                    return
            tell("done")

        return verdict(attempt(work, dict(tests)))

    def _replace_functions(self, mutant: Mutant, source: str) -> None:
        place = str(Path(mutant.file).resolve())
        before = list(_codes(compile(source, place, "exec", dont_inherit=True)))
        after = list(_codes(compile(mutant.applied(source), place, "exec", dont_inherit=True)))
        if [code.co_qualname for code in before] != [code.co_qualname for code in after]:
            raise NotReplaceableError
        changed = {_key(old): new for old, new in zip(before, after, strict=True) if old != new}
        replaced = 0
        for function in self._functions[place]:
            code = changed.get(_key(function.__code__))
            if code is not None:
                try:
                    function.__code__ = code
                except ValueError:
                    raise NotReplaceableError from None
                replaced += 1
        if not replaced:
            raise NotReplaceableError
        for name, module in list(sys.modules.items()):
            if name.startswith("nacre."):
                for value in list(vars(module).values()):
                    clear = getattr(value, "cache_clear", None)
                    if callable(clear):
                        clear()


def _codes(code: types.CodeType) -> Iterator[types.CodeType]:
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            yield constant
            yield from _codes(constant)


def _key(code: types.CodeType) -> tuple[str, int]:
    return code.co_qualname, code.co_firstlineno


def append(path: Path, row: dict[str, Any]) -> None:
    """A line of JSON."""
    with path.open("a") as file:
        file.write(json.dumps(row) + "\n")
