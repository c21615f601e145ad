"""Files that are whole or absent, and how their content is known."""

from __future__ import annotations

import hashlib
import io
import json
import os
import platform
import re
import secrets
import stat
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, TypeAlias

from nacre.errors import FormatError, did_you_mean
from nacre.io.format import HEAD
from nacre.io.marks import never_marked
from nacre.io.outputs import check_replaceable, mark_output, remember_output

PathLike: TypeAlias = str | os.PathLike[str]
Identity: TypeAlias = tuple[int, int, int]

_EMPTY = "is empty; copy or download it again"
_SETTLED = 2_000_000_000  # nanoseconds since a file was written

_TEMPORARY = re.compile(r"\.([0-9a-f]{6})([0-9a-f]{6})[0-9a-f]{4}(\.\w+)?")
"""Names that :func:`atomic_path` makes: a mark of the file to write, the process, anything."""
_PROCESSES = 0xFFFFFF  # numbers of processes; larger ones on Windows are not checked there


def first_bytes(path: PathLike, count: int = HEAD) -> bytes:
    """Up to `count` bytes from the start of a regular file; none if it cannot be read."""
    with suppress(FormatError):
        return read_head(path, count)
    return b""


def read_head(path: PathLike, count: int = HEAD) -> bytes:
    """Up to `count` bytes from the start of a file; never waits, as a pipe would make it.

    Raises FormatError if it is no regular file, is empty or cannot be read.
    """
    found = identity(path)
    # A file that was written just now may change again and keep its time.
    settled = found is not None and time.time_ns() - found[2] > _SETTLED
    head = (_head if settled else _head.__wrapped__)(Path(path), count, found)
    if not head:
        raise FormatError(f"{path}: {_EMPTY}")
    return head


@lru_cache(maxsize=64)
def _head(path: Path, count: int, _identity: Identity | None) -> bytes:
    """The start of a file, read once as long as the file is the same."""
    with opened(path) as file:
        return file.read(count)


def identity(path: PathLike) -> Identity | None:
    """Inode, size and time of change of a regular file; None for anything else."""
    try:
        found = Path(path).stat()
    except OSError:
        return None
    regular = stat.S_ISREG(found.st_mode)
    return (found.st_ino, found.st_size, found.st_mtime_ns) if regular else None


@contextmanager
def file_errors(path: PathLike, done: str = "read") -> Iterator[None]:
    """A block whose errors from the system become a :class:`FormatError` that names the file.

    `done` is the verb for the message: the file cannot be read, or written.
    """
    try:
        yield
    except FileNotFoundError as error:
        if done == "read":
            raise missing(path) from error
        raise FormatError(f"{path}: cannot be {done}: {error.strerror or error}") from error
    except OSError as error:
        raise FormatError(f"{path}: cannot be {done}: {error.strerror or error}") from error


def missing(path: PathLike, names: Iterable[str] = ()) -> FormatError:
    """The error for a file that is not there, with similar names: of files in its folder, or of
    what `names` could stand in its place, such as included bases.
    """
    path = Path(path)
    if not path.parent.is_dir():
        return FormatError(f"{path}: no such file, and no folder {path.parent}")
    found: list[str] = []
    with suppress(OSError), os.scandir(path.parent) as entries:
        found = [entry.name for entry in entries if not entry.name.startswith(".")]
    alike = [name for name in found if Path(name).stem == path.stem]
    spelled = [*names, *(str(path.with_name(name)) for name in sorted(found))]
    same_stem = [str(path.with_name(name)) for name in sorted(alike)]
    for similarity, known in ((0.9, spelled), (0.2, same_stem), (0.7, spelled)):
        if hint := did_you_mean(str(path), known, similarity=similarity):
            return FormatError(f"{path}: no such file{hint}")
    return FormatError(f"{path}: no such file")


@contextmanager
def opened(path: PathLike) -> Iterator[io.BufferedReader]:
    """A regular file to read; failures are those of :func:`file_errors`."""
    with file_errors(path):
        check_regular(Path(path))
        with Path(path).open("rb") as file:
            yield file


def check_regular(path: Path) -> int:
    """Size in bytes of a regular file.

    Raises :class:`FormatError` if it is a folder, or a pipe, on which opening could wait forever,
    :class:`OSError` if there is nothing, or it cannot be examined.
    """
    found = path.stat()
    if stat.S_ISDIR(found.st_mode):
        raise FormatError(f"{path}: is a directory, expected a file")
    if not stat.S_ISREG(found.st_mode):
        raise FormatError(f"{path}: is not a regular file, but a pipe or a device")
    return found.st_size


def read_bytes(path: PathLike, limit: int) -> bytes:
    """Whole content of a file of at most `limit` bytes.

    Raises FormatError if the path is absent, a directory, unreadable, empty or larger than `limit`.
    """
    path = Path(path)
    with file_errors(path):
        check_size(path, limit)
        return path.read_bytes()


def check_size(path: Path, limit: int) -> None:
    """Refuse a file that is empty or larger than a limit in bytes, or that :func:`check_regular`
    refuses, by the same errors.
    """
    size = check_regular(path)
    if size == 0:
        raise FormatError(f"{path}: {_EMPTY}")
    if size > limit:
        raise FormatError(f"{path}: {size} bytes, more than the {limit} this format can need")


def check_json(content: object) -> None:
    """Refuse by a ValueError what could be read from JSON but not be written again, or shown.

    That is a number that is not finite, half a character, or what is nested too deep.
    """
    try:
        json.dumps(content, allow_nan=False, ensure_ascii=False).encode()
    except RecursionError as error:
        raise ValueError("nested too deep") from error


def digest(path: PathLike) -> str:
    """SHA-256 of a file's content, in hexadecimal; a FormatError if it cannot be read."""
    with opened(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def check_writable(path: PathLike) -> None:
    """Raise now what :func:`atomic_path` would raise when the work for a file is done."""
    path = Path(path)
    check_replaceable(path)
    _claim(path).unlink()


def check_not_inputs(outputs: Iterable[PathLike], inputs: Iterable[PathLike]) -> None:
    """Raise a FormatError before work starts if a file that it writes is one that it reads."""
    taken = {Path(path).resolve() for path in inputs}
    for path in outputs:
        if Path(path).resolve() in taken:
            raise FormatError(f"{path}: is the input as well; name another output")


@contextmanager
def atomic_path(path: PathLike, *, internal: bool = False) -> Iterator[Path]:
    """A temporary path in the folder of `path` that replaces `path` when the block succeeds.

    The temporary name keeps the suffix of `path`. If the block raises, nothing is left behind and
    an existing file at `path` stays as it was; a file that is replaced passes on its permissions.
    What a killed process left behind here is removed when another one writes the same file again.

    An `internal` file is nacre's own, such as a state or a cache: it is replaced without a question
    and not marked as an output.

    Raises FormatError if `path` is a directory, its folder is absent or cannot be written, or a
    file is there that must not be replaced: see :mod:`nacre.io.outputs`.
    """
    path = Path(path)
    if not internal:
        check_replaceable(path)
    before = identity(path)
    temporary = _claim(path)
    try:
        with file_errors(path, "written"):
            yield temporary
            if not internal and not never_marked(path):
                mark_output(temporary)
            with temporary.open("rb+") as file:
                os.fsync(file.fileno())
            with suppress(FileNotFoundError):
                if not path.is_symlink():
                    temporary.chmod(stat.S_IMODE(path.stat().st_mode))
            if not internal and identity(path) != before:  # it came while the block worked
                check_replaceable(path)
            temporary.replace(path)
    finally:
        _remove_if_possible(temporary)
    if not internal:
        remember_output(path)


def remove_file(path: PathLike) -> None:
    """Remove a file of nacre's own that is no longer needed, such as a state, if it is there.

    This also removes what killed processes left behind as they wrote it, which nobody will write
    again.
    """
    path = Path(path)
    path.unlink(missing_ok=True)
    _remove_stale(path.parent, _owner(path))


def write_encoded(
    path: PathLike, encode: Callable[[Any], bytes], content: Any, *, internal: bool = False
) -> None:
    """Write `encode(content)` to a file, whole or not at all; see :func:`atomic_path`.

    A :class:`FormatError` from `encode` is made to name the file.
    """
    try:
        data = encode(content)
    except FormatError as error:
        raise FormatError(f"{path}: {error}") from error
    with atomic_path(path, internal=internal) as temporary:
        temporary.write_bytes(data)


def write_together(contents: Mapping[Path, bytes]) -> None:
    """Write files that belong together; see :func:`atomic_path`.

    All of them are written before the first takes its place. If one cannot, those that were not
    there before are removed again: they are of no use alone.
    """
    placed: list[Path] = []  # where there was no file before

    @contextmanager
    def placing(path: Path) -> Iterator[Path]:
        new = not os.path.lexists(path)
        with atomic_path(path) as temporary:
            yield temporary
        if new:
            placed.append(path)

    try:
        with ExitStack() as stack:
            for path, content in contents.items():
                stack.enter_context(placing(path)).write_bytes(content)
    except BaseException:
        for path in placed:
            _remove_if_possible(path)
        raise


def append_line(path: PathLike, line: str) -> None:
    """Add a line, which ends in a line break, to a file: whole or not at all.

    It begins on a line of its own even after one that a killed process has left unfinished. Raises
    OSError if it cannot be written; the file is then as it was.
    """
    with Path(path).open("ab+", buffering=0) as file:  # a buffer would try again as it closes
        size = file.seek(0, os.SEEK_END)
        if size:
            file.seek(size - 1)
            if file.read(1) != b"\n":
                line = "\n" + line
        left = line.encode()
        try:
            while left:
                left = left[file.write(left) :]
            os.fsync(file.fileno())
        except OSError:
            with suppress(OSError):
                os.truncate(path, size)
            raise


def abandoned(folder: PathLike) -> list[Path]:
    """Temporary files of :func:`atomic_path` in a folder, of killed or working processes."""
    with os.scandir(folder) as entries:
        return [Path(entry.path) for entry in entries if _TEMPORARY.fullmatch(entry.name)]


def _claim(path: Path) -> Path:
    """A new empty file beside `path`, hidden, with the permissions of any new file."""
    if path.is_dir():
        raise FormatError(f"{path}: is a directory, expected a file name to write")
    if not path.parent.is_dir():
        raise FormatError(f"{path}: folder {path.parent} does not exist; create it first")
    owner = _owner(path)
    _remove_stale(path.parent, owner)
    process = f"{os.getpid() & _PROCESSES:06x}"
    temporary = path.with_name(f".{owner}{process}{secrets.token_hex(2)}{path.suffix}")
    with file_errors(path, "written"):
        try:
            temporary.touch(exist_ok=False)
        except FileExistsError:
            raise
        except OSError:  # it may be there all the same: closing it can fail
            _remove_if_possible(temporary)
            raise
    return temporary


def _remove_if_possible(path: Path) -> None:
    """Remove a file if it is there; an error that is under way matters more than one of this."""
    with suppress(OSError):
        path.unlink()


def _owner(path: Path) -> str:
    """The mark in the names of temporary files of the file that they are to become."""
    return hashlib.sha256(os.fsencode(f"{platform.node()}/{path.name}")).hexdigest()[:6]


def _remove_stale(folder: Path, owner: str) -> None:
    """Remove temporary files with the mark of a file whose processes, on this machine, are dead."""
    with suppress(OSError):  # a folder that cannot be listed or changed
        for path in _found_first(folder.absolute()):
            match = _TEMPORARY.fullmatch(path.name)
            if match and match[1] == owner and not _runs(int(match[2], 16)):
                path.unlink(missing_ok=True)


@cache
def _found_first(folder: Path) -> list[Path]:
    """The temporary files that this process finds when it first writes into a folder.

    Listing a large folder takes longer than writing a file.
    """
    return abandoned(folder)


def _runs(process: int) -> bool:
    """Whether there is such a process, as far as one can know."""
    if os.name != "posix":
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:  # it is another user's
        pass
    return True
