"""How packed files are unpacked: never to more bytes than :func:`_limit`, whatever they claim."""

from __future__ import annotations

import bz2
import lzma
import re
import stat
import zipfile
import zlib
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from nacre.errors import FormatError, reason
from nacre.io.disguise import UNPACK, disguise, quoted
from nacre.io.files import PathLike, first_bytes, opened
from nacre.io.names import PACKED, guessed_ending

_WHOLE, _RATIO, _MOST = 1 << 26, 32, 1 << 32
"""Bytes that any file may unpack to, that each of its bytes may, and that none may exceed."""
_DICTIONARY = 80 << 20  # bytes of memory to unpack .xz: enough for what xz -9 makes
_PIECE = 1 << 20
_SHOWN, _TRIED = 5, 16
"""Most files of an archive that a message names, and that are looked at."""
_STREAMS: dict[bytes, tuple[str, Callable[[], Any]]] = {
    b"\x1f\x8b\x08": (".gz", lambda: zlib.decompressobj(wbits=31)),
    b"BZh": (".bz2", bz2.BZ2Decompressor),
    b"\xfd7zXZ\0": (".xz", lambda: lzma.LZMADecompressor(memlimit=_DICTIONARY)),
}
"""How packed files begin, end and are unpacked."""
_BESIDE = re.compile(r"(^|/)(\.(?!\.?/)|__macosx/|thumbs\.db$|desktop\.ini$)", re.IGNORECASE)
"""What archives hold that nobody put there."""
_DOCUMENTS = (
    (r"word/", "is a Word document; save the table that holds the samples as .csv"),
    (r"ppt/|mimetype$", "is a document; save the table that holds the samples as .csv"),
    (
        r"([^/]+/)?data\.pkl$",
        "is a PyTorch file, which would run code; save its weights as .safetensors",
    ),
    (r"[^/]+\.usd[ac]?$", f"is a USD package (.usdz); {UNPACK}"),
)
"""Archives that people take for documents, by names in them."""
_UNREADABLE = (zipfile.BadZipFile, NotImplementedError, ValueError, EOFError, zlib.error, OSError)


def unpack(
    path: Path, folder: Path, endings: Callable[[], Collection[str]], wanted: Callable[[Path], bool]
) -> Path:
    """Put what a packed file holds into a folder; see :func:`nacre.io.packed.unpacked`."""
    head = first_bytes(path)
    if found := _stream(head):
        return _from_stream(path, head, *found, folder)
    return _from_archive(path, folder, endings, wanted)


def _stream(head: bytes) -> tuple[str, Callable[[], Any]] | None:
    return next((found for magic, found in _STREAMS.items() if head.startswith(magic)), None)


def _from_stream(
    path: Path, head: bytes, ending: str, decompressor: Callable[[], Any], folder: Path
) -> Path:
    file = folder / "content"
    with _problems(path, ending), path.open("rb") as packed:
        _write(_pieces(packed, decompressor), file, path, _limit(path))
    start = first_bytes(file)
    if ".tar" in (found := disguise(start, path)):
        raise FormatError(f"{path}: {found}")
    name = path.stem if path.suffix.lower() in PACKED else path.name
    if not Path(name).suffix:
        name += _original_ending(head) or guessed_ending(start)
    return file.rename(folder / name)


def _pieces(packed: IO[bytes], decompressor: Callable[[], Any]) -> Iterator[bytes]:
    """Unpacked content, from one stream after another; EOFError if the last is cut short."""
    unpacker, data = decompressor(), b""
    while True:
        # What zlib leaves of its input is to be given again; the others keep it themselves.
        data = data or (b"" if _holds_more(unpacker) else packed.read(_PIECE))
        if not data and not _holds_more(unpacker):
            raise EOFError
        piece = unpacker.decompress(data, _PIECE)
        data = getattr(unpacker, "unconsumed_tail", b"")
        if piece:
            yield piece
        if unpacker.eof:
            data = (unpacker.unused_data or packed.read(_PIECE)).lstrip(b"\0")
            if not data:
                return
            unpacker = decompressor()


def _holds_more(unpacker: Any) -> bool:
    return not getattr(unpacker, "needs_input", True)


def _from_archive(
    path: Path,
    folder: Path,
    endings: Callable[[], Collection[str]],
    wanted: Callable[[Path], bool],
) -> Path:
    with _problems(path, ".zip"), zipfile.ZipFile(path) as archive:
        members = _members(archive)
        names = [member.filename for member in members]
        for pattern, words in _DOCUMENTS:
            if any(re.match(pattern, name) for name in names):
                raise FormatError(f"{path}: {words}")
        if not members:
            raise FormatError(f"{path}: is an archive of no files; copy or download it again")
        left = _limit(path)

        def extract(member: zipfile.ZipInfo) -> Path:
            nonlocal left
            if member.flag_bits & 1:
                raise FormatError(f"{path}: needs a password; {UNPACK}")
            if member.compress_type == zipfile.ZIP_LZMA:  # claims any memory
                raise NotImplementedError
            place = folder / str(members.index(member)) / _plain(member.filename)
            place.parent.mkdir()
            with archive.open(member) as packed:
                left -= _write(iter(lambda: packed.read(_PIECE), b""), place, path, left)
            return place

        if len(members) == 1:
            return extract(members[0])
        found: list[Path] = []
        likely = [m for m in members if Path(m.filename).suffix.lower() in endings()]
        if len(likely) <= _TRIED:
            found = [place for place in map(extract, likely) if wanted(place)]
            if len(found) == 1:
                return found[0]
    shown = ", ".join(names[:_SHOWN]) + (", ..." if len(names) > _SHOWN else "")
    none = "" if found or len(likely) > _TRIED else ", none of them a material by itself"
    problem = f"is an archive of {len(names)} files ({shown}){none}"
    raise FormatError(f"{path}: {problem}; {UNPACK}: unzip {quoted(path.name)}")


def _members(archive: zipfile.ZipFile) -> list[zipfile.ZipInfo]:
    """The files in an archive that someone put there; links do not count."""
    return [
        member
        for member in archive.infolist()
        if not member.is_dir()
        and not _BESIDE.search(member.filename)
        and not stat.S_ISLNK(member.external_attr >> 16)
    ]


def is_archive(path: PathLike) -> bool:
    """Whether a file that begins as a `.zip` archive is one, but not of NumPy's arrays, nor a
    spreadsheet.
    """
    if Path(path).suffix.lower() == ".npz":
        return False
    try:
        with opened(path) as file, zipfile.ZipFile(file) as archive:
            names = archive.namelist()
            return "xl/workbook.xml" not in names and not all(n.endswith(".npy") for n in names)
    except _UNREADABLE:  # the list at its end is missing
        head = first_bytes(path)
        length = int.from_bytes(head[26:28], "little")
        return not head[30 : 30 + length].endswith(b".npy")


def names_in(path: PathLike) -> list[str]:
    """Names of the files in a `.zip` archive, without their folders; none if it is damaged."""
    try:
        with opened(path) as file, zipfile.ZipFile(file) as archive:
            return [Path(member.filename).name for member in _members(archive)]
    except _UNREADABLE:
        return []


def _plain(name: str) -> str:
    """The last part of a name in an archive, as a name for a file."""
    last = re.split(r"[/\\]", name)[-1]
    kept = "".join(c if c.isprintable() and c not in '<>:"|?*' else "_" for c in last)
    return kept if len(kept.encode(errors="replace")) < 200 else f"content{Path(kept).suffix[:20]}"


def _write(pieces: Iterable[bytes], file: Path, path: Path, limit: int) -> int:
    """Write pieces to a file; returns their bytes. Raises FormatError above a limit in bytes."""
    size = 0
    with file.open("wb") as target:
        for piece in pieces:
            size += len(piece)
            if size > limit:
                problem = f"unpacks to more than {limit:,} bytes"
                raise FormatError(f"{path}: {problem}; if you trust it, unpack it first")
            target.write(piece)
    return size


def _limit(path: Path) -> int:
    return min(_MOST, max(_WHOLE, _RATIO * path.stat().st_size))


@contextmanager
def _problems(path: Path, ending: str) -> Iterator[None]:
    """A block that unpacks; a FormatError names the file and what is wrong with it."""
    try:
        yield
    except FormatError:
        raise
    except EOFError as error:
        problem = f"is an unfinished {ending} file, cut short; copy or download it again"
        raise FormatError(f"{path}: {problem}") from error
    except NotImplementedError as error:
        raise FormatError(f"{path}: is packed in an unusual way; {UNPACK}") from error
    except (MemoryError, lzma.LZMAError) as error:
        if isinstance(error, lzma.LZMAError) and "limit" not in str(error):
            problem = f"is a damaged or unfinished {ending} file; copy or download it again"
        else:
            problem = "needs too much memory to unpack; unpack it first"
        raise FormatError(f"{path}: {problem}") from error
    except (zipfile.BadZipFile, zlib.error, ValueError, OSError) as error:
        if getattr(error, "errno", None):  # the system's; bz2 has none
            raise FormatError(f"{path}: cannot be unpacked: {reason(error)}") from error
        problem = f"is a damaged or unfinished {ending} file"
        raise FormatError(f"{path}: {problem}; copy or download it again") from error


def _original_ending(head: bytes) -> str:
    """The ending of the name that gzip has kept, if any (RFC 1952, section 2.3.1)."""
    if not head.startswith(b"\x1f\x8b\x08") or head[3] & 0b1100 != 0b1000:
        return ""
    name = head[10:].partition(b"\0")[0].decode("latin-1")
    return Path(name).suffix if re.fullmatch(r"[\w. +-]+", name) else ""
