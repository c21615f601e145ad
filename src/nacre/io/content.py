"""What the content of a file looks like, for a message about one of no known format.

First bytes are those of :func:`nacre.io.head.recognized_head`.
"""

from __future__ import annotations

import json
import re

_TEXT = re.compile(rb"[\t\n\f\r\x20-\x7e\x80-\xff]*")
_NUMBERS = re.compile(r"[-+\d.,;eE\s]*\d[-+\d.,;eE\s]*")
_KINDS = {
    "xml": ("Radiance BSDF", "MaterialX"),
    "json": ("OpenMATERIAL 3D", "glTF"),
    "numbers": ("comma-separated samples", "Zemax BSDF"),
    "HDF5": ("NBRDF network (Keras)",),
    "binary": ("MERL", "RGL"),
}
"""Formats of each kind of content, the most common ones first."""


def is_text(head: bytes) -> bool:
    """Whether the first bytes of a file are text, in UTF-8 or one byte a character."""
    return _TEXT.fullmatch(head) is not None


def is_table(head: bytes) -> bool:
    """Whether the first bytes of a file are text with lines of numbers."""
    return _kind(head) == "numbers"


def looks_like(head: bytes) -> str:
    """What first bytes are, in words: "JSON with a, b and c at the top"."""
    text = _text(head)
    match _kind(head):
        case "xml":
            root = re.search(r"<([A-Za-z_][\w:.-]*)", text)
            return f"XML ({f'<{root[1][:40]}>' if root else 'no element'})"
        case "json":
            names = list(dict.fromkeys(re.findall(r'"([\w $.:-]{1,40})"\s*:', text)))[:3]
            return f"JSON (with {', '.join(map(json.dumps, names))})" if names else "JSON"
        case "numbers":
            line = next(line for line in text.splitlines() if line.strip())
            return f"a table as text, which begins {line.strip()[:40]!r}"
        case "text":
            line = next((line for line in text.splitlines() if line.strip()), "")
            return f"text, which begins {line.strip()[:40]!r}"
        case kind:
            return f"{kind} data"


def formats_like(head: bytes) -> tuple[str, ...]:
    """Names of formats whose files have content of this kind."""
    return _KINDS.get(_kind(head), ())


def _kind(head: bytes) -> str:
    if head.startswith(b"\x89HDF\r\n\x1a\n"):
        return "HDF5"
    if not is_text(head):
        return "binary"
    text = _text(head)
    if text.startswith("<"):
        return "xml"
    if text.startswith(("{", "[")):
        return "json"
    lines = [line for line in text.splitlines()[:40] if line.strip()]
    numbers = sum(_NUMBERS.fullmatch(line) is not None for line in lines)
    return "numbers" if numbers >= 2 else "text"


def _text(head: bytes) -> str:
    return head.decode("utf-8", "replace").lstrip()
