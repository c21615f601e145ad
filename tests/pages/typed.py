"""Type what a page says, in order, in the working folder, and stop at the first line that fails.

`python -P typed.py PAGE [RESULTS]` types with the commands beside that Python, and needs no other
package than nacre. The function in RESULTS that has the page's name then gets the names that its
Python left. Of the code blocks in the page,

- those without a language are lines of a shell, but for the `INSTALLING` ones; what they draw by
  chance takes few samples unless they say how many (`FEW`);
- `python` runs in this process, names stay from block to block;
- `text` is what the block before it printed: `...` is any text, numbers agree to a tenth;
- one in another language is saved if the paragraph before it says "Save this as `NAME`", otherwise
  it is for reading (`READ`), but what it calls must be in a file that the page made.

A line whose comment begins with "refused" must end with exit code 2; one "until Ctrl-C" gets it
once it has printed an address. A block after `<!-- not run: WHY -->` is left out.
"""

from __future__ import annotations

import io
import math
import os
import re
import runpy
import signal
import subprocess
import sys
import time
import traceback
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

INSTALLING = ("apt-get ", "jupyter ", "make ", "pip ", "python3 -m venv ", "source ")
"""How lines begin that set up or end outside the folder."""

FEW = {"btf capture": ["--paths 8"], "render": ["--spp 4", "--size 128"]} | {
    f"latent {command}": ["--spp 4"] for command in ("interpolate", "sample")
}
"""Options that commands are given, as pictures of full quality would take most of the time."""

READ = ("glsl", "html", "js", "slang", "xml")

_LIMIT = 900  # seconds for a line
_NUMBER = r"\d+(?:\.\d+)?(?:e[-+]\d+)?"


def quick(line: str) -> str:
    """A line whose commands take few samples, see :data:`FEW`; scenes keep their sizes."""
    for command, given in FEW.items():
        for option in given:
            name = option.split()[0]
            if name not in line and not (name == "--size" and ".xml" in line):
                line = re.sub(rf"\bnacre {command}\b", rf"nacre {command} {option}", line)
    return line


@dataclass(frozen=True)
class Block:
    """A code block of a page, and the number of its first line."""

    line: int
    language: str
    text: str
    why_not: str  # it is not run; empty if it is
    name: str  # of the file that it is saved as; empty for none


def blocks(page: str) -> Iterator[Block]:
    """The code blocks of a page, in order."""
    for found in re.finditer(r"^```(\w*)\n(.*?)^```$", page, re.S | re.M):
        before = page[: found.start()].rstrip()
        mark = re.search(r"<!-- not run: ([^<>]+) -->$", before)
        saved = re.search(r"[Ss]ave this as `([\w.]+)`", before.rpartition("\n\n")[2])
        yield Block(
            page[: found.start(2)].count("\n") + 1,
            found[1],
            found[2],
            mark[1] if mark else "",
            saved[1] if saved and found[1] not in ("", "python", "text") else "",
        )


def shell_lines(block: Block) -> Iterator[tuple[int, str]]:
    """Numbered lines of a shell, those that end in a backslash joined to the next."""
    for found in re.finditer(r"(?:.*\\\n)*.+", block.text):
        line = found[0].replace("\\\n", " ")
        if not line.startswith(("#", *INSTALLING)):
            yield block.line + block.text[: found.start()].count("\n"), line


def shows(expected: str, printed: str) -> bool:
    """Whether a text was printed: `...` is any text, numbers agree to a tenth."""
    parts = re.split(rf"(\.\.\.|\s+|{_NUMBER})", expected.strip())
    kinds = {"...": r"[\s\S]*?", "number": f"({_NUMBER})", "space": r"\s+"}
    pattern, numbers = "", []
    for part in parts:
        if re.fullmatch(_NUMBER, part):
            numbers.append(float(part))
            pattern += kinds["number"]
        else:
            pattern += kinds.get("space" if part.isspace() else part) or re.escape(part)
    return any(
        all(map(lambda a, b: math.isclose(a, float(b), rel_tol=0.1), numbers, found.groups()))
        for found in re.finditer(pattern, printed)
    )


class TypingError(Exception):
    """A line of a page did not do what the page says."""


class Typist:
    """Types blocks, and knows what the last one printed."""

    def __init__(self, page: Path) -> None:
        self._page = page
        self.names: dict[str, Any] = {"__name__": "__main__"}
        self._printed = ""

    def type(self, block: Block) -> None:
        """Do what a block says; a TypingError says which line fails, and what it printed."""
        if block.why_not:
            return
        if block.name:
            Path(block.name).write_text(block.text, "utf-8")
        elif block.language == "text":
            if not shows(block.text, self._printed):
                raise self._error(block.line, "this is not printed", self._printed)
        elif block.language == "python":
            self._printed = self._python(block)
        elif block.language:
            self._read(block)
        else:
            self._printed = "".join(self._shell(*line) for line in shell_lines(block))

    def _error(self, line: int, problem: str, printed: str) -> TypingError:
        return TypingError(f"{self._page}:{line}: {problem}\n{printed}")

    def _python(self, block: Block) -> str:
        began, out = time.monotonic(), io.StringIO()
        try:
            code = compile("\n" * (block.line - 1) + block.text, str(self._page), "exec")
            with redirect_stdout(out), redirect_stderr(out):
                exec(code, self.names)
        except Exception:
            last = traceback.format_exc()
            raise self._error(block.line, "this fails", out.getvalue() + last) from None
        _tell(began, f"{block.text.splitlines()[0]} ...")
        return out.getvalue()

    def _shell(self, number: int, line: str) -> str:
        began = time.monotonic()
        process = subprocess.Popen(
            ["bash", "-c", quick(line)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        assert process.stdout is not None
        first = ""
        if "until Ctrl-C" in line:
            while "http" not in first and (more := process.stdout.readline()):
                first += more
            os.killpg(process.pid, signal.SIGINT)
        try:
            printed = first + process.communicate(timeout=_LIMIT)[0]
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            raise self._error(number, f"{line}\nis not done in {_LIMIT} s", "") from None
        expected = [2] if re.search(r"# refused\b", line) else [0, 130 if first else 0]
        if process.returncode not in expected:
            problem = f"{line}\nends with exit code {process.returncode}"
            raise self._error(number, problem, printed)
        _tell(began, line)
        return printed

    def _read(self, block: Block) -> None:
        if block.language not in READ:
            raise self._error(block.line, f"who runs {block.language}?", "")
        files = [path for path in Path().rglob("*") if path.is_file()]
        stems = {path.name.partition(".")[0] for path in files}
        called = {
            name
            for name in re.findall(r"\b[a-z]\w+(?=\()", block.text)
            if any(name.startswith(f"{stem}_") for stem in stems)
        }
        written = [p.read_text("utf-8") for p in files if p.suffix == f".{block.language}"]
        if missing := sorted(name for name in called if not any(name in w for w in written)):
            raise self._error(block.line, f"no file defines {', '.join(missing)}", "")


def _tell(began: float, what: str) -> None:
    print(f"{time.monotonic() - began:6.1f} s  {what}", flush=True)


def main(page: Path, results: Path | None = None) -> int:
    """Type a page, and check what its Python left; 1 if a line fails."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.path.insert(0, "")
    os.environ["PATH"] = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    typist = Typist(page)
    try:
        for block in blocks(page.read_text("utf-8")):
            typist.type(block)
    except TypingError as error:
        print(error)
        return 1
    if results is not None and (check := runpy.run_path(str(results)).get(page.stem)):
        check(typist.names)
    return 0


if __name__ == "__main__":
    raise SystemExit(main(*map(Path, sys.argv[1:])))
