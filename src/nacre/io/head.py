"""What a file begins with, as its format is known by."""

from __future__ import annotations

import re
from pathlib import Path

from nacre.io.files import PathLike, opened, read_head
from nacre.io.format import HEAD

_COMMENTS = re.compile(rb"[\xef\xbb\xbf\xff\xfe]*+(?>[\s\0]*+#[^\r\n]*+)++[\s\0]*+")
_OTHER = (b"#?RADIANCE", b"#usda")  # first words of formats, not comments
_FIRST, _MOST = 1 << 14, 1 << 24  # bytes that are searched for the end of comments


def recognized_head(path: PathLike) -> bytes:
    """The first :data:`HEAD` bytes of a file, which decide on its format.

    Where they begin a comment, the first bytes behind it follow: tools write pages of lines with a
    `#` before the first word that tells. Raises FormatError as :func:`nacre.io.files.read_head`.
    """
    head = read_head(path)
    if head.startswith(_OTHER) or not _COMMENTS.match(head):
        return head
    return head + b"\n" + _behind_comments(Path(path))


def _behind_comments(path: Path) -> bytes:
    """Up to :data:`HEAD` bytes from the first line that is neither empty nor a comment."""
    with opened(path) as file:
        data, wanted = b"", _FIRST
        while len(data) < wanted <= _MOST:
            data += file.read(wanted - len(data))
            match = _COMMENTS.match(data)
            end = match.end() if match else 0
            if end + HEAD <= len(data):
                break
            wanted = 2 * wanted if len(data) == wanted else 0
        return data[end : end + HEAD]
