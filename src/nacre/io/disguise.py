"""What a file is that is no data, though its name says so: a web page, a pointer, an archive.

Servers answer with pages where a file has moved or wants a login, and tools leave a few lines in
place of a large file: whoever has such a file needs to hear what it is, and what to do.
"""

from __future__ import annotations

import re
from pathlib import Path

from nacre.io.files import PathLike, opened

_AGAIN = "download the file again"
_PAGE = f"is a web page, not data: open it in a browser to see what it says, then {_AGAIN}"
_ANNEX = "its content is not here; run 'git annex get' on it"
UNPACK = "unpack it, then give the file or folder in it"
"""What to do with an archive."""
_PICTURE = "is a picture ({}), not a measurement; a texture is a folder of pictures with a list"
_PICKLE = "is a Python pickle, which would run code; save its arrays with numpy.savez and load that"
_MATLAB = "is a MATLAB file; save the values as text (.csv) or, in Python, with numpy.savez"
_OFFICE = "is a {} document; save the sheet that holds the samples as .csv"

_TEXTS: tuple[tuple[str, str], ...] = (
    (r"(<\?xml[^>]*>\s*)?(<!--((?!-->).)*-->\s*)*<(!doctype html|html|head|body|script)\b", _PAGE),
    (
        r"(<\?xml[^>]*>\s*)?<(error|html|response)\b",
        f"is a server's error message (XML), not data: read it in an editor, then {_AGAIN}",
    ),
    (
        r'\{\s*"(message|error|errors|detail|status|statuscode|code)"\s*:',
        f"is a server's answer (JSON), not data: read it in an editor, then {_AGAIN}",
    ),
    (
        r"([45]\d\d:? )?(bad request|unauthorized|forbidden|access denied|not found|too many "
        r"requests|internal server error|bad gateway|service unavailable|gateway time-?out)\b",
        f"is a server's error message, not data: {_AGAIN}",
    ),
    (
        "version https://(git-lfs|hawser)",
        "is a Git LFS pointer, not the data; run 'git lfs pull' in its folder",
    ),
    (r"(\.\./)*(\.git)?/annex/objects/", f"is a git-annex pointer: {_ANNEX}"),
    (
        r"(datatype:[^\n]{0,40}\(rt-300s\)|name / comment.{0,800}\breflet\b)",
        "holds raw signals of an RT-300S or Reflet goniometer, not reflectance; convert it to f_r "
        "first, for example with bsdf-tools, and give the Zemax or FRED file",
    ),
    (r"\[internetshortcut\]", f"is a link to a web page, not data: open it and {_AGAIN}"),
)
"""Beginnings of texts, in any case, behind a byte order mark and blanks."""

_BYTES: tuple[tuple[bytes, str], ...] = (
    (b"%PDF-", "is a PDF document; nacre reads tables, not documents"),
    (b"7z\xbc\xaf\x27\x1c", f"is a 7-Zip archive (.7z); {UNPACK}: 7z x {{name}}"),
    (b"Rar!\x1a\x07", f"is a RAR archive (.rar); {UNPACK}: unrar x {{name}}"),
    (b"\x28\xb5\x2f\xfd", "is packed with Zstandard (.zst); unpack it first: zstd -d {name}"),
    (b"\x04\x22\x4d\x18", "is packed with LZ4 (.lz4); unpack it first: lz4 -d {name}"),
    (b"\x1f\x9d\x90", "is packed with compress (.Z); unpack it first: uncompress {name}"),
    (b"PK\5\6", "is an empty .zip archive; copy or download it again"),
    (b"MATLAB 5.0 MAT-file", _MATLAB),
    (b"MATLAB 7.3 MAT-file", _MATLAB),
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", _OFFICE.format("Word or Excel")),
    (b"\xff\xd8\xff", _PICTURE.format("JPEG")),
    (b"GIF8", _PICTURE.format("GIF")),
    (b"II*\0", _PICTURE.format("TIFF")),
    (b"MM\0*", _PICTURE.format("TIFF")),
    (b"#?RADIANCE", _PICTURE.format("Radiance")),
    (b"\0\5\x16\7", "is what macOS keeps beside a file; use the one whose name lacks '._'"),
    (b"SQLite format 3\0", "is an SQLite database; write the samples as .csv"),
    (b"PAR1", "is a Parquet table; write the samples as .csv"),
)
"""First bytes of files of other kinds."""

_PICKLES = re.compile(rb"\x80[\2-\5][\x95\x8c\x63\x7d\x5d\x28\x58\x71\x4b\x4d\x4a\x47\x89\x88\x4e]")
_UNFINISHED = (
    ".part",
    ".partial",
    ".crdownload",
    ".download",
    ".opdownload",
    ".aria2",
    ".filepart",
)
_TAR = 257  # where an archive of this kind says so


def disguise(head: bytes, path: PathLike) -> str:
    """What a file is instead of data and what to do about it, to follow its name in a message.

    `head` is its first bytes. Empty for any other file: those of known formats, and unknown ones.
    """
    name = Path(path).name
    if name.lower().endswith(_UNFINISHED):
        return f"is an unfinished download; let it finish, or {_AGAIN}"
    if words := next((words for start, words in _BYTES if head.startswith(start)), ""):
        return words.format(name=quoted(name))
    if head[_TAR : _TAR + 5] == b"ustar":
        return f"is a .tar archive; {UNPACK}: tar xf {quoted(name)}"
    if head[:4] == b"RIFF" and head[8:12] == b"WEBP":
        return _PICTURE.format("WebP")
    if _PICKLES.match(head):
        return _PICKLE
    start = head.removeprefix(b"\xef\xbb\xbf").replace(b"\0", b"").lstrip(b"\xff\xfe \t\r\n")
    text = start.decode("latin-1").lower()
    return next((words for begin, words in _TEXTS if re.match(begin, text, re.DOTALL)), "")


def zeros(path: PathLike) -> str:
    """As :func:`disguise` for a file of nothing but zeros."""
    with opened(path) as file:
        if any(any(part) for part in iter(lambda: file.read(1 << 20), b"")):
            return ""
    return f"holds only zeros, as a download leaves that never got its data; {_AGAIN}"


def missing(path: PathLike) -> str:
    """As :func:`disguise` for a link of git-annex to content that was not fetched."""
    path = Path(path)
    if path.is_symlink() and not path.exists() and "annex/objects" in str(path.readlink()):
        return f"is a git-annex link: {_ANNEX}"
    return ""


def quoted(name: str) -> str:
    """A file's name as one would type it in a shell."""
    return name if re.fullmatch(r"[\w.+-]+", name) else f"'{name}'"
