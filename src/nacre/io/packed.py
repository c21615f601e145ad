"""Packed files (`.gz`, `.bz2`, `.xz`, and `.zip` of one file), read as what is in them.

They are unpacked into a temporary folder, under the name that the content has there.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from nacre.errors import FormatError, printable
from nacre.io.disguise import UNPACK
from nacre.io.files import PathLike, first_bytes
from nacre.io.names import PACKED
from nacre.io.unpacked import kept

_ZIP = b"PK\3\4"
_STREAMS = b"\x1f\x8b\x08", b"BZh", b"\xfd7zXZ\0"
"""First bytes of packed files: of archives, and of what holds one file without its name."""


def inner_names(path: PathLike) -> list[str]:
    """What a file is called when unpacked: its own name unless it ends as a packed file does.

    For a `.zip` file these are the names in it, if it can be read.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in PACKED:
        return [path.name]
    if ending == ".zip":
        from nacre.io.unpacking import names_in

        return names_in(path) or [path.stem]
    return [path.stem]


def is_packed(path: PathLike, head: bytes) -> bool:
    """Whether a file is packed, by its first bytes; NumPy's `.npz` archives do not count."""
    if not head.startswith(_ZIP):
        return head.startswith(_STREAMS)
    from nacre.io.unpacking import is_archive

    return is_archive(path)


@contextmanager
def unpacked(
    path: PathLike, endings: Callable[[], Collection[str]], wanted: Callable[[Path], bool]
) -> Iterator[Path]:
    """The file in a packed file, as long as the block lasts.

    Errors about the file in it become ones about the packed file.

    Parameters
    ----------
    path
        A file that :func:`is_packed`.
    endings
        Gives those of files that `wanted` may want, in lower case.
    wanted
        Chooses between the files of an archive.

    Raises
    ------
    FormatError
        If a packed file is damaged or cut short, needs a password, unpacks to too many bytes, or
        is an archive of several files of which not exactly one is wanted.
    """
    from nacre.io.unpacking import unpack

    path = Path(path)
    with kept(path, lambda folder: unpack(path, folder, endings, wanted)) as file:
        try:
            if is_packed(file, first_bytes(file)):
                raise FormatError(f"{path}: is packed twice; {UNPACK}")
            yield file
        except FormatError as error:
            problem = str(error)
            for inner in (file, file.parent):
                problem = problem.replace(printable(str(inner)), printable(str(path)))
            raise FormatError(problem) from error
