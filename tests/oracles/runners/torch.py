"""Modules of PyTorch, imported by a process that cannot import nacre."""

from __future__ import annotations

import json
import subprocess
import sys
import weakref
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from nacre.array import Weights
from tests.oracles.runner import Runner

_WORKER = Path(__file__).with_name("torch_worker.py")


class PyTorch(Runner):
    """See :mod:`tests.oracles.runners.torch`; one process serves all calls."""

    target, title = "pytorch", "PyTorch"

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None

    def missing(self) -> str | None:
        """See :class:`Runner`."""
        return None if find_spec("torch") else "torch"

    def run(
        self, files: Mapping[str, bytes], name: str, function: str, a: Weights, b: Weights
    ) -> Weights:
        """See :class:`Runner`."""
        with TemporaryDirectory() as folder:
            self._ask(Path(folder), files, function, a, b)
            found: Weights = np.load(Path(folder, "found.npy"))
            return found

    def rate(self, files: Mapping[str, bytes], name: str, a: Weights, b: Weights) -> float:
        """See :class:`Runner`; each operation on its own, without `torch.compile`."""
        with TemporaryDirectory() as folder:
            return float(len(a) / self._ask(Path(folder), files, "rate", a, b)["seconds"])

    def _ask(
        self, folder: Path, files: Mapping[str, bytes], function: str, a: Weights, b: Weights
    ) -> dict[str, Any]:
        """What the process answers."""
        for file, content in files.items():
            (folder / file).write_bytes(content)
        np.save(folder / "a.npy", a)
        np.save(folder / "b.npy", b)
        if self._process is None:
            command = [sys.executable, "-I", str(_WORKER)]
            pipe = subprocess.PIPE
            self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True)
            weakref.finalize(self, _end, self._process)
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        order = {"folder": str(folder), "file": next(iter(files)), "function": function}
        print(json.dumps(order), file=self._process.stdin, flush=True)
        answer: dict[str, Any] = json.loads(
            self._process.stdout.readline() or '{"error": "the process died"}'
        )
        if "error" in answer:
            raise RuntimeError(answer["error"])
        return answer


def _end(process: subprocess.Popen[str]) -> None:
    """The process ends where its input does."""
    process.communicate()
