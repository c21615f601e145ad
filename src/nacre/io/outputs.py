"""Which files may be replaced: those that the same command wrote, and nobody changed since.

Measurements cost days, so nothing else is replaced unless the user says so. What nacre wrote is
known by the mark in it (:mod:`nacre.io.marks`), wherever it was copied or moved. A Python program
may also replace what it wrote itself in formats without a place for a mark.
"""

from __future__ import annotations

import itertools
import os
import stat
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

from nacre.errors import FormatError
from nacre.io.marks import add_mark, can_be_marked, read_mark

PathLike = str | os.PathLike[str]


@dataclass(frozen=True)
class _Policy:
    """What is writing now, for all threads of the process, and whether it may replace anything."""

    command: str = ""
    force: bool = False
    run: int = 0  # number of the command in this process; 0 outside of commands


_policy = _Policy()

_runs = itertools.count(1)
_written: dict[Path, tuple[int, int, int]] = {}
"""Size, time of change and run of the files that this process wrote and that no mark tells of."""


@contextmanager
def _applied(policy: _Policy) -> Iterator[None]:
    global _policy
    before, _policy = _policy, policy
    try:
        yield
    finally:
        _policy = before


def overwrite(force: bool = True) -> AbstractContextManager[None]:
    """A block in which outputs replace whatever file is there, read-only ones too, if `force`."""
    return _applied(replace(_policy, force=_policy.force or force))


def written_by(command: str) -> AbstractContextManager[None]:
    """A block whose outputs belong to one command: they replace only what it wrote before.

    Outside such blocks, as in a user's Python program, they replace what any command wrote.
    """
    return _applied(replace(_policy, command=command, run=next(_runs)))


def check_replaceable(path: PathLike) -> None:
    """Refuse to write where there is a file that must not be replaced.

    It is a link, read-only, owned by another user, or has no mark that says that this command wrote
    it, or was changed since. Not within :func:`overwrite`.
    """
    path = Path(path)
    if _policy.force:
        return
    try:
        status = path.lstat()
    except OSError:  # nothing there, or nothing that could be written either
        return
    if not stat.S_ISDIR(status.st_mode) and (problem := _problem(path, status)):
        raise FormatError(f"{path}: {problem}; name another output, or use --force to replace it")


def mark_output(path: Path) -> None:
    """Mark a file that was just written as this command's, if its format has a place for that."""
    add_mark(path, _policy.command)


def remember_output(path: Path) -> None:
    """Note that this run wrote a file, if it has no mark: it may write it again."""
    with suppress(OSError):
        if read_mark(path) is None:
            status = path.lstat()
            _written[_absolute(path)] = status.st_size, status.st_mtime_ns, _policy.run


def _absolute(path: Path) -> Path:
    """The path of a file whose folder has no links left, but which may be one itself."""
    return path.parent.resolve() / path.name


def _problem(path: Path, status: os.stat_result) -> str:
    """Why a file must not be replaced; empty where it may be."""
    if stat.S_ISLNK(status.st_mode):
        return "is a symbolic link"
    if not stat.S_ISREG(status.st_mode):
        return "is not a regular file"
    if not status.st_mode & 0o222:
        return "exists and is read-only"
    if hasattr(os, "geteuid") and status.st_uid != os.geteuid():
        return "exists and belongs to another user"
    now = status.st_size, status.st_mtime_ns, _policy.run
    if _written.get(_absolute(path)) == now:
        return ""
    try:
        mark = read_mark(path)
    except OSError as error:
        return f"exists and cannot be read: {error.strerror or error}"
    if mark is None and can_be_marked(path):
        return "exists, and nothing in it says that nacre wrote it"
    if mark is None:
        return f"exists, and {path.suffix} files do not say who wrote them"
    if not mark.whole:
        return "exists and was changed since nacre wrote it"
    if _policy.command and mark.command != _policy.command:
        by = "a program" if mark.command == "nacre" else mark.command
        return f"exists and was written by {by}"
    return ""
