"""What a file begins with, as its format is known by."""

from __future__ import annotations

import re
from pathlib import Path

from nacre.io.files import PathLike, opened, read_head
from nacre.io.format import HEAD

_COMMENTS = re.compile(rb"[\xef\xbb\xbf\xff\xfe]*+(?>[\s\0]*+#[^\r\n]*+)++[\s\0]*+")
_XML_COMMENTS = re.compile(
    rb"(?:\xef\xbb\xbf)?(?>\s*+<(?:\?[^>]*+>|!--(?>[^-]|-(?!->))*+(?:-->|\Z)))++\s*+"
)
_OTHER = (b"#?RADIANCE", b"#usda")  # first words of formats, not comments
_MARKS = {b"\xef\xbb\xbf": "utf-8", b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}
_FIRST, _MOST = 1 << 14, 1 << 24  # bytes that are searched for the end of comments


def recognized_head(path: PathLike) -> bytes:
    """The first :data:`HEAD` bytes of a file, which decide on its format.

    Where they begin a comment, the bytes around its end follow: tools write pages of lines with a
    `#`, or comments of XML, before the first word that tells. Text comes as UTF-8 without a byte
    order mark, as far as its own mark says what it is. Raises FormatError as
    :func:`nacre.io.files.read_head`.
    """
    head = read_head(path)
    comments = _XML_COMMENTS if b"<!--" in head else _COMMENTS
    if not head.startswith(_OTHER) and comments.match(head):
        behind = _end_of_comments(Path(path), comments)
        return _unmarked(head) + b"\n#" + _unmarked(head[: len(_mark(head))] + behind)
    return _unmarked(head)


def _mark(head: bytes) -> bytes:
    return next((mark for mark in _MARKS if head.startswith(mark)), b"")


def _unmarked(head: bytes) -> bytes:
    if mark := _mark(head):
        return head[len(mark) :].decode(_MARKS[mark], "ignore").encode()
    return head


def _end_of_comments(path: Path, comments: re.Pattern[bytes]) -> bytes:
    """Up to :data:`HEAD` bytes before and behind the first line that is no comment nor empty."""
    with opened(path) as file:
        data, wanted = b"", _FIRST
        while len(data) < wanted <= _MOST:
            data += file.read(wanted - len(data))
            match = comments.match(data)
            end = match.end() if match else 0
            if end + HEAD <= len(data):
                break
            wanted = 2 * wanted if len(data) == wanted else 0
        start = max(end - HEAD, HEAD)
        return data[start - start % 2 : end + HEAD]
