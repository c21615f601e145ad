"""The mark by which a file is known as nacre's own, wherever it is copied or moved.

It names the command that wrote the file, and has a digest of everything else in it, so that a file
that was changed since is known too: `nacre fit 0f3a...`. It stands where readers of the format look
for such things or pass over them: in a chunk for text, a comment, metadata, or behind the end.
"""

from __future__ import annotations

import hashlib
import json
import re
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from io import BufferedRandom, BufferedReader
from pathlib import Path
from typing import NamedTuple

_DIGITS = 32
_MARK = re.compile(rb"(nacre(?: [a-z][a-z-]*)*) ([0-9a-f]{%d})" % _DIGITS)
_REGION = 1 << 10  # bytes at an end of a file in which a mark stands
_HEADER = 1 << 24  # bytes of a safetensors header
_CHUNK = b"tEXtSoftware\0"  # of a PNG
_LINES = {
    b"// %b\n": ".h .glsl .slang .wgsl .osl .mdl .js",
    b"# %b\n": ".py .usda .brdf",
    b"<!-- %b -->\n": ".html .svg .xml .mtlx .md",
    b"%%%b\n": ".pdf",
    b"%b\n": ".exr .h5 .hdf5 .ktx2 .txt .bsdf",
}
"""Lines with a mark that readers pass over behind the end, each with the endings of files."""
_LINE = {ending: line for line, endings in _LINES.items() for ending in endings.split()}


class Mark(NamedTuple):
    """What a mark says."""

    command: str
    """The command that wrote the file, such as "nacre fit"; "nacre" in a Python program."""
    whole: bool
    """Whether nobody has changed the file since."""


@dataclass(frozen=True)
class _Place:
    """Where a mark goes: its `content` takes the place of bytes of the file."""

    start: int
    stop: int
    content: Callable[[bytes], bytes]
    sized: int | None = None
    """Where a file has its own size less `size_from`, as 32 bits."""
    size_from: int = 0


def can_be_marked(path: Path) -> bool:
    """Whether files of this ending have a place for a mark; what is in them may still leave none.

    Measured tables whose size follows from their header have none.
    """
    endings = ".safetensors .png .jpg .jpeg .gif .webp .npz .zip .json .glb .onnx .csv"
    return path.suffix.lower() in {*_LINE, *endings.split()}


def add_mark(path: Path, command: str) -> None:
    """Mark a file that was just written, if its format has a place for that."""
    with path.open("rb+") as file:
        place = _place(file, path.suffix.lower())
        if place is None:
            return
        name = command.encode() if _MARK.fullmatch(f"{command} {'0' * _DIGITS}".encode()) else b""
        blank = (name or b"nacre") + b" " + b"0" * _DIGITS
        file.seek(place.stop)
        rest = file.read()
        file.seek(place.start)
        file.write(place.content(blank) + rest)
        file.truncate()
        if place.sized is not None:
            size = file.tell() - place.size_from
            file.seek(place.sized)
            file.write(size.to_bytes(4, "little"))
        digest = _digest(file, (0, b""))
        file.seek(place.start)
        file.write(place.content(blank[:-_DIGITS] + digest))


def read_mark(path: Path) -> Mark | None:
    """The mark of a regular file; None if it has none. Raises OSError if it cannot be read."""
    with path.open("rb") as file:
        start, region = _region(file, path.suffix.lower())
        found = list(_MARK.finditer(region))
        if not found:
            return None
        match = found[0 if region.startswith(b"#") else -1]
        blank = bytearray(region)
        blank[match.start(2) : match.end(2)] = b"0" * _DIGITS
        if region[match.start() - len(_CHUNK) : match.start()] == _CHUNK:
            begin, end = match.start() - len(_CHUNK), match.end()
            if region[end : end + 4] == _checksum(region[begin:end]):
                blank[end : end + 4] = _checksum(bytes(blank[begin:end]))
        whole = _digest(file, (start, bytes(blank))) == match[2]
        return Mark(match[1].decode(), whole)


def _digest(file: BufferedReader | BufferedRandom, part: tuple[int, bytes]) -> bytes:
    """Digest of a file with other bytes in one part of it."""
    start, content = part
    hashed = hashlib.sha256()
    file.seek(0)
    left = start
    while left and (piece := file.read(min(left, 1 << 20))):
        hashed.update(piece)
        left -= len(piece)
    hashed.update(content)
    file.seek(start + len(content))
    while piece := file.read(1 << 20):
        hashed.update(piece)
    return hashed.hexdigest()[:_DIGITS].encode()


def _region(file: BufferedReader | BufferedRandom, ending: str) -> tuple[int, bytes]:
    """The part of a file in which its mark stands, and where it begins."""
    head = file.read(8)
    file.seek(0)
    if ending == ".safetensors":
        return 0, file.read(8 + min(int.from_bytes(head, "little"), _HEADER))
    if _begins_with_comments(head, ending):
        return 0, file.read(_REGION)
    size = file.seek(0, 2)
    start = max(0, size - _REGION)
    file.seek(start)
    return start, file.read()


def _begins_with_comments(head: bytes, ending: str) -> bool:
    """Whether a table of text has lines for comments before the values: nacre's own, and Zemax."""
    return head.startswith(b"#") and ending in (".csv", ".bsdf")


def _place(file: BufferedRandom, ending: str) -> _Place | None:
    """Where to put a mark into a file without one; None if it is not what its ending says."""
    _, region = _region(file, ending)
    size = file.seek(0, 2)
    file.seek(0)
    head = file.read(32)

    def at_end(tail: bytes, content: Callable[[bytes], bytes], *sized: int) -> _Place | None:
        fits = region.endswith(tail)
        return _Place(size - len(tail), size, content, *sized) if fits else None

    if ending == ".safetensors":
        return _in_header(region)
    if _begins_with_comments(head, ending):
        after = region.find(b"\n") + 1
        return _Place(after, after, lambda text: b"# written by: %b\n" % text) if after else None
    if ending == ".png" and head.startswith(b"\x89PNG"):
        end = b"\0\0\0\0IEND\xaeB`\x82"
        return at_end(end, lambda text: _png_chunk(text) + end)
    if ending in (".jpg", ".jpeg") and head.startswith(b"\xff\xd8"):
        return at_end(
            b"\xff\xd9",
            lambda t: b"\xff\xfe%b%b\xff\xd9" % ((len(t) + 2).to_bytes(2, "big"), t),
        )
    if ending == ".gif" and head.startswith(b"GIF"):
        return at_end(b";", lambda text: b"!\xfe%c%b\0;" % (len(text), text))
    if ending == ".webp" and head[8:16] == b"WEBPVP8X":
        return at_end(b"", lambda text: _chunk(b"NACR", text, 2), 4, 8)
    if ending == ".glb" and head.startswith(b"glTF"):
        return at_end(b"", lambda text: _chunk(b"NACR", text, 4, size_first=True), 8)
    if ending in (".npz", ".zip") and region[-22:-18] == b"PK\5\6":
        return at_end(b"\0\0", lambda text: len(text).to_bytes(2, "little") + text)
    if ending == ".onnx":
        return at_end(b"", _onnx_property)
    if ending == ".json" and re.match(rb'\{\s*"', head):
        tail = re.search(rb"\s*\}\s*\Z", region)
        return at_end(tail[0], lambda t: b',\n "written_by": "%b"\n}\n' % t) if tail else None
    if not head.startswith({".brdf": b"analytic", ".bsdf": b"tensor_file"}.get(ending, b"")):
        return None  # measurements in other formats with these endings
    return at_end(b"", lambda text: _LINE[ending] % text) if ending in _LINE and size else None


def _in_header(header: bytes) -> _Place | None:
    """In the metadata of a safetensors file of nacre's, behind what else is there."""
    before = b'{"__metadata__":'
    if header[8 : 8 + len(before)] != before:
        return None
    text = header[8:].decode()
    _, end = json.JSONDecoder().raw_decode(text, len(before))

    def content(mark: bytes) -> bytes:
        entry = f',"written by":"{mark.decode()}"'
        made = (text[: end - 1] + entry + text[end - 1 :]).encode().rstrip(b" ")
        made += b" " * (-len(made) % 8)
        return len(made).to_bytes(8, "little") + made

    return _Place(0, len(header), content)


def _png_chunk(text: bytes) -> bytes:
    content = _CHUNK + text
    length = (len(content) - 4).to_bytes(4, "big")
    return length + content + _checksum(content)


def _checksum(content: bytes) -> bytes:
    """What follows the name and content of a chunk of a PNG."""
    return zlib.crc32(content).to_bytes(4, "big")


def _chunk(name: bytes, text: bytes, align: int, *, size_first: bool = False) -> bytes:
    """A chunk as in a RIFF file; in glTF's, the size counts the padding and comes first."""
    padded = text + b" " * (-len(text) % align)
    return (
        len(padded).to_bytes(4, "little") + name + padded
        if size_first
        else name + len(text).to_bytes(4, "little") + padded
    )


def _onnx_property(text: bytes) -> bytes:
    """An entry of an ONNX model's `metadata_props`, which protocol buffers take at the end."""
    key = b"written_by"
    entry = b"\x0a%c%b\x12%c%b" % (len(key), key, len(text), text)
    return b"\x72%c%b" % (len(entry), entry)
