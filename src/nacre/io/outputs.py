"""Which files may be replaced: those that the same command wrote, and nobody changed since.

Measurements cost days, so nothing else is replaced unless the user says so. What nacre wrote is
recorded in the user's folder for states (`NACRE_STATE`, else the platform's): for each output a
small file with its size, its time of change and the command that wrote it.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import platformdirs

from nacre.errors import FormatError

PathLike = str | os.PathLike[str]


@dataclass(frozen=True)
class _Policy:
    """What is writing now, for all threads of the process, and whether it may replace anything."""

    command: str = ""
    force: bool = False


_policy = _Policy()


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
    return _applied(replace(_policy, command=command))


def check_replaceable(path: PathLike) -> None:
    """Refuse to write where there is a file that must not be replaced.

    It is a link, read-only, owned by another user, or not known as written by nacre, by this
    command and unchanged since. Not within :func:`overwrite`.
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


def record_output(path: PathLike, upcoming: PathLike | None = None) -> None:
    """Note that this command wrote a file; where that cannot be noted, the file counts as a
    stranger's.

    `upcoming` is about to take its name: whichever of them a process leaves that is killed between
    is then known.
    """
    path = Path(path)
    record = _record(path)
    with suppress(OSError):
        status = Path(upcoming or path).lstat()
        state = {"size": status.st_size, "modified_ns": status.st_mtime_ns}
        known = {"path": str(_absolute(path)), "command": _policy.command}
        content = {**known, **state} if upcoming is None else {**known, "upcoming": state}
        if upcoming is not None:
            content = _read(record) | content
        record.parent.mkdir(parents=True, exist_ok=True)
        temporary = record.with_suffix(f".{os.getpid():x}")
        temporary.write_text(json.dumps(content), encoding="utf-8")
        temporary.replace(record)


def _read(record: Path) -> dict[str, Any]:
    """What a record holds; nothing if it cannot be read."""
    with suppress(OSError, ValueError, RecursionError):
        content = json.loads(record.read_text(encoding="utf-8"))
        if isinstance(content, dict):
            return content
    return {}


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
    known = _read(_record(path))
    upcoming = known.get("upcoming")
    states = [known, upcoming if isinstance(upcoming, dict) else {}]
    if not any("size" in state for state in states) or "command" not in known:
        return "exists and was not written by nacre"
    now, command = (status.st_size, status.st_mtime_ns), str(known["command"])
    same = any((state.get("size"), state.get("modified_ns")) == now for state in states)
    if not same:
        return "exists and was changed since nacre wrote it"
    if _policy.command and command != _policy.command:
        return f"exists and was written by {command or 'another program'}"
    return ""


def _record(path: Path) -> Path:
    name = hashlib.sha256(os.fsencode(_absolute(path))).hexdigest()[:40]
    return records_folder() / name[:2] / name


def records_folder() -> Path:
    """Folder of the records of outputs: in `NACRE_STATE`, else in the platform's for states."""
    return Path(os.environ.get("NACRE_STATE") or platformdirs.user_state_dir("nacre"), "outputs")


def _absolute(path: Path) -> Path:
    """The path of a file whose folder has no links left, but which may be one itself."""
    return path.parent.resolve() / path.name
