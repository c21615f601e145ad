"""Commands run many times in forks of one process that has imported what they need.

`python -m tests.faults.forks`, with the library of :mod:`tests.faults.calls` preloaded, reads what
to run and what is to fail, a line of JSON for each run, and prints what came of it.
"""

from __future__ import annotations

import atexit
import gc
import importlib
import itertools
import json
import os
import select
import signal
import subprocess
import sys
import traceback
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from tests.faults.calls import LARGE, Kind, library, plan
from tests.faults.commands import ROOT

PATIENCE = 900.0
"""Seconds after which a run hangs."""
ASKED = 5
"""Times that long work asks whether a state is due, until one is."""


@dataclass(frozen=True)
class Run:
    """What came of a run: exit code, standard error, calls of each kind, how many failed and the
    name of the first.
    """

    code: int
    text: str
    counts: list[int]
    failed: int
    call: str


class Forks:
    """The process that forks."""

    def __init__(self) -> None:
        path = os.pathsep.join(str(ROOT / part) for part in ("src", "", "lab/src"))
        environment = {"PYTHONPATH": path, "OMP_NUM_THREADS": "1", "LD_PRELOAD": str(library())}
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.faults.forks"],
            env={**os.environ, **environment},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def run(
        self, arguments: list[str], folder: Path, kind: Kind | None = None, number: int = 0
    ) -> Run:
        """Run a command in a folder, in whose files the n-th call of a kind fails; 0: none does."""
        asked: dict[str, object] = {"arguments": arguments, "folder": str(folder), "number": number}
        how = (kind.calls, kind.error, kind.lasting) if kind else (1, 0, False)
        asked |= zip(("kind", "error", "lasting"), how, strict=True)
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps(asked) + "\n")
        self._process.stdin.flush()
        return Run(**json.loads(self._process.stdout.readline()))

    def close(self) -> None:
        """End the process."""
        self._process.communicate()


def main() -> None:
    """Fork for each line of standard input."""
    from nacre.runtime.store import Store

    asked = itertools.count(1)
    Store.due = lambda *_: next(asked) % ASKED == 0  # type: ignore[method-assign]
    shared = plan()
    shared.large = LARGE
    _import(["nacre.cli"])
    known: set[tuple[str, ...]] = set()
    for line in iter(sys.stdin.readline, ""):
        asks = json.loads(line)
        shared.number, shared.error, shared.lasting = (
            asks[name] for name in ("number", "error", "lasting")
        )
        shared.folder, shared.call, shared.failed = asks["folder"].encode(), b"", 0
        shared.counts[:] = [0] * len(shared.counts)
        told, names = (os.memfd_create(name) for name in ("told", "names"))
        process = os.fork()
        if not process:
            os.chdir(asks["folder"])
            os.environ["TMPDIR"] = f"{asks['folder']}/tmp"
            shared.kind = asks["kind"]
            _child(asks["arguments"], told, names)
        code = _ended(process)
        shared.kind = 0
        reply = {
            "code": code,
            "text": os.pread(told, 1 << 20, 0).decode(errors="replace"),
            "counts": list(shared.counts),
            "failed": shared.failed,
            "call": shared.call.decode(),
        }
        if tuple(asks["arguments"]) not in known:
            known.add(tuple(asks["arguments"]))
            _import(os.pread(names, 1 << 24, 0).decode().split())
        os.close(told)
        os.close(names)
        print(json.dumps(reply), flush=True)


def _child(arguments: list[str], told: int, names: int) -> NoReturn:
    """Run the command, and end this process as it would, but for the interpreter's own end."""
    os.setsid()
    nothing = os.open(os.devnull, os.O_RDWR)
    for file, other in ((nothing, 0), (nothing, 1), (told, 2)):
        os.dup2(file, other)
    from nacre.cli import main as run

    code = 0
    try:
        run(["-q", *arguments])
    except SystemExit as end:
        code = int(end.code or 0)
    except BaseException:
        traceback.print_exc()
        code = 1
    atexit._run_exitfuncs()
    sys.stderr.flush()
    os.write(names, "\n".join(sys.modules).encode())
    os._exit(code)


def _ended(process: int) -> int:
    """Exit code of a process, or the negative number of the signal that ended it."""
    file = os.pidfd_open(process)
    if not select.select([file], [], [], PATIENCE)[0]:
        os.killpg(process, signal.SIGKILL)
    os.close(file)
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


def _import(names: list[str]) -> None:
    """Import what a run has imported, but for Dr.Jit and what needs it: that starts a thread."""
    sys.modules["drjit"] = None  # type: ignore[assignment]
    for name in names:
        if name not in sys.modules and not name.startswith("mitsuba"):
            with suppress(Exception):
                importlib.import_module(name)
    del sys.modules["drjit"]
    threads = len(list(Path("/proc/self/task").iterdir()))
    assert threads == 1, f"{threads} threads, which a fork would lose"
    gc.collect()
    gc.freeze()


if __name__ == "__main__":
    main()
