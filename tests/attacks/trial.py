"""Run the commands of attacks in this one process, and print what came of each.

Standard input is JSON: commands to warm up with, and commands by name.
"""

from __future__ import annotations

import contextlib
import io
import json
import resource
import sys
import time

from nacre.cli import main


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
    warm, commands = json.load(sys.stdin)
    for arguments in warm:  # what is imported late is not an attack's
        tried(arguments)
    for name, arguments in commands.items():
        print(json.dumps({"name": name, **tried(arguments)}), flush=True)
