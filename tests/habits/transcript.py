"""Sessions of a person at a terminal and in Python, and what they should have seen.

A transcript is a text of blocks: a line that begins with `$ ` (a shell) or `>>> ` (Python, goes on
with `... `), and below it what is printed: standard output, then standard error, then `[2]` for an
exit code of 2. `...` stands for any text, alone on a line for any lines. Lines of `#` are comments.
"""

from __future__ import annotations

import ast
import io
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.cli.support import run

_SHELL, _PYTHON, _MORE = "$ ", ">>> ", "... "


@dataclass(frozen=True)
class Block:
    """One thing that is typed, and what should be printed."""

    line: int
    typed: str
    python: bool
    expected: str


def blocks(path: Path) -> Iterator[Block]:
    """The blocks of a transcript, in order."""
    lines = path.read_text("utf-8").splitlines()
    starts = [i for i, line in enumerate(lines) if line.startswith((_SHELL, _PYTHON))]
    for start, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        python, rest = lines[start].startswith(_PYTHON), lines[start + 1 : end]
        typed = [lines[start].removeprefix(_PYTHON if python else _SHELL)]
        while python and rest and rest[0].startswith(_MORE):
            typed.append(rest.pop(0).removeprefix(_MORE))
        expected = "\n".join(line for line in rest if not line.startswith("#"))
        yield Block(start + 1, "\n".join(typed), python, expected.strip())


def matches(expected: str, printed: str) -> bool:
    """Whether a text is what was expected, with `...` for any text."""
    parts = [
        r"(?:.*\n)*?" if line.strip() == "..." else _line(line) + r"\n"
        for line in expected.splitlines()
    ]
    return (
        re.fullmatch("".join(parts), printed.strip("\n") + "\n" if printed.strip() else "")
        is not None
    )


def _line(line: str) -> str:
    return ".*".join(re.escape(part) for part in line.rstrip().split("..."))


class Terminal:
    """Runs blocks in the working folder; names in Python stay from block to block."""

    def __init__(self) -> None:
        self._names: dict[str, Any] = {}

    def printed(self, block: Block) -> str:
        """What a block prints."""
        return self._python(block.typed) if block.python else self._shell(block.typed)

    def _python(self, source: str) -> str:
        out, err = io.StringIO(), io.StringIO()
        with redirect_stdout(out), redirect_stderr(err):
            try:
                body = ast.parse(source)
                last = body.body[-1]
                if isinstance(last, ast.Expr):
                    rest = ast.Module(body.body[:-1], [])
                    exec(compile(rest, "<typed>", "exec"), self._names)
                    value = eval(
                        compile(ast.Expression(last.value), "<typed>", "eval"), self._names
                    )
                    if value is not None:
                        print(repr(value))
                else:
                    exec(compile(body, "<typed>", "exec"), self._names)
            except Exception as error:
                print(f"{type(error).__name__}: {error}", file=err)
        return _joined(out.getvalue(), err.getvalue())

    @staticmethod
    def _shell(line: str) -> str:
        words = shlex.split(line)
        if words[0] == "nacre" and not {*"|<>;&*$"} & {*line}:
            out, err = io.StringIO(), io.StringIO()
            with redirect_stdout(out), redirect_stderr(err):
                code = run(*words[1:], quiet=False)
            return _joined(out.getvalue(), err.getvalue(), code)
        path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
        done = subprocess.run(
            ["bash", "-c", line],
            capture_output=True,
            text=True,
            stdin=subprocess.DEVNULL,
            env={**os.environ, "PATH": path},
        )
        return _joined(done.stdout, done.stderr, done.returncode)


def _joined(out: str, err: str, code: int = 0) -> str:
    parts = [out.strip("\n"), err.strip("\n"), f"[{code}]" if code else ""]
    return "\n".join(part.rstrip() for part in parts if part.strip())
