"""Give every attack in a folder to its command, in this one process, and print what came of it."""

from __future__ import annotations

import contextlib
import io
import json
import os
import resource
import sys
import time
from pathlib import Path

from nacre.cli import main
from tests.attacks.files import ATTACKS


def tried(arguments: list[str]) -> dict[str, object]:
    """Exit code, text and cost of a command: seconds, and MiB that the process grew by."""
    out, err = io.StringIO(), io.StringIO()
    before, start, code = _resident(), time.process_time(), 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main(["-q", *arguments])
        except SystemExit as end:
            code = int(end.code or 0)
    return {
        "code": code,
        "out": out.getvalue(),
        "err": err.getvalue(),
        "seconds": time.process_time() - start,
        "grown": _resident() - before,
    }


def _resident() -> float:
    """Most memory that the process has had, in MiB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


if __name__ == "__main__":
    os.chdir(sys.argv[1])
    for name, attack in ATTACKS.items():
        (first, last), path = attack.command, attack.write(Path(name))
        arguments = [*first, str(path), *last]
        if name == next(iter(ATTACKS)):
            for whole in json.loads(sys.argv[2]):  # what is imported late is not an attack's
                tried(whole)
        print(json.dumps({"name": name, **tried(arguments)}), flush=True)
