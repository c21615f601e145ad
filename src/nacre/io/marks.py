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
_GLB = 20  # bytes before the JSON of a .glb
_CHUNK = b"tEXtSoftware\0"  # of a PNG
_CODE = ".h", ".glsl", ".slang", ".wgsl", ".osl", ".mdl", ".js"
_PAGES = ".html", ".svg", ".xml", ".mtlx", ".md"
_END = b"\0\0\0\0IEND\xaeB`\x82"


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
    sized: tuple[int, int] | None = None


@dataclass(frozen=True)
class _Form:
    """How files of a format take a mark at their end."""

    content: Callable[[bytes], bytes]
    begins: bytes = b""
    """What files of the format begin with, where other formats have the ending too."""
    ends: bytes = b""
    """What they end with, which is part of the content."""
    sized: tuple[int, int] | None = None
    """Place of a file's own size, as 32 bits, and what that leaves out."""


def _png(text: bytes) -> bytes:
    content = _CHUNK + text
    length = (len(content) - 4).to_bytes(4, "big")
    return length + content + _checksum(content) + _END


def _checksum(content: bytes) -> bytes:
    """What follows the name and content of a chunk of a PNG."""
    return zlib.crc32(content).to_bytes(4, "big")


def _jpeg(text: bytes) -> bytes:
    return b"\xff\xfe%b%b\xff\xd9" % ((len(text) + 2).to_bytes(2, "big"), text)


def _webp(text: bytes) -> bytes:
    return b"NACR%b%b%b" % (len(text).to_bytes(4, "little"), text, b"\0" * (len(text) % 2))


def _zip(text: bytes) -> bytes:
    return len(text).to_bytes(2, "little") + text


def _onnx(text: bytes) -> bytes:
    """An entry of a model's `metadata_props`, which protocol buffers take at the end."""
    key = b"written_by"
    entry = b"\x0a%c%b\x12%c%b" % (len(key), key, len(text), text)
    return b"\x72%c%b" % (len(entry), entry)


def _line(form: bytes, begins: bytes = b"") -> _Form:
    """A line that readers pass over behind the end."""
    return _Form(lambda text: form % text, begins)


_FORMS = {
    ".png": _Form(_png, b"\x89PNG", _END),
    ".jpg": _Form(_jpeg, b"\xff\xd8", b"\xff\xd9"),
    ".gif": _Form(lambda text: b"!\xfe%c%b\0;" % (len(text), text), b"GIF", b";"),
    ".webp": _Form(_webp, b"RIFF", sized=(4, 8)),
    ".npz": _Form(_zip, b"PK", b"\0\0"),
    ".json": _Form(lambda text: b',\n "written_by": "%b"\n}\n' % text, b"{", b"\n}\n"),
    ".onnx": _Form(_onnx),
    ".pdf": _line(b"%%%b\n", b"%PDF"),
    ".brdf": _line(b"# %b\n", b"analytic"),
    ".bsdf": _line(b"%b\n", b"tensor_file"),
    **{ending: _line(b"// %b\n") for ending in _CODE},
    **{ending: _line(b"<!-- %b -->\n") for ending in _PAGES},
    **{ending: _line(b"# %b\n") for ending in (".py", ".usda")},
    **{ending: _line(b"%b\n") for ending in (".exr", ".h5", ".hdf5", ".ktx2", ".txt")},
}
_FORMS |= {".jpeg": _FORMS[".jpg"], ".zip": _FORMS[".npz"]}


_STRICT = ".fred.txt"  # FRED's tables, which have no comments


def never_marked(path: Path) -> bool:
    """Whether tools would stumble over a mark in a file of this name."""
    return path.name.lower().endswith(_STRICT)


def can_be_marked(path: Path) -> bool:
    """Whether files of this ending have a place for a mark; what is in them may still leave none.

    Measured tables whose size follows from their header have none.
    """
    return path.suffix.lower() in {*_FORMS, ".safetensors", ".glb"} and not never_marked(path)


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
            size = file.tell() - place.sized[1]
            file.seek(place.sized[0])
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
    head = file.read(_GLB)
    file.seek(0)
    if ending == ".safetensors":
        return 0, file.read(8 + min(int.from_bytes(head[:8], "little"), _HEADER))
    if ending == ".glb":
        return 0, file.read(_GLB + min(int.from_bytes(head[12:16], "little"), _HEADER))
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
    head = file.read(16)
    if ending == ".safetensors":
        return _in_header(region)
    if ending == ".glb":
        return _in_extras(region, size)
    if _begins_with_comments(head, ending):
        after = region.find(b"\n") + 1
        return _Place(after, after, lambda text: b"# written by: %b\n" % text) if after else None
    form = _FORMS.get(ending)
    if form is None or not head.startswith(form.begins) or not region.endswith(form.ends):
        return None
    return _Place(size - len(form.ends), size, form.content, form.sized) if size else None


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


def _in_extras(header: bytes, size: int) -> _Place | None:
    """In the `extras` of a .glb file of a number of bytes, at the end of its JSON."""
    text = header[_GLB:].rstrip(b" ")
    if not header.startswith(b"glTF") or not text.endswith(b"}") or b'"extras"' in text:
        return None

    def content(mark: bytes) -> bytes:
        made = text[:-1] + b',"extras":{"written_by":"%b"}}' % mark
        made += b" " * (-len(made) % 4)
        total = size + len(made) - (len(header) - _GLB)
        sizes = total.to_bytes(4, "little") + len(made).to_bytes(4, "little")
        return header[:8] + sizes + header[16:_GLB] + made

    return _Place(0, len(header), content)
