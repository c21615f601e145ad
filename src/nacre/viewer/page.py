"""The page as one file: markup, style and scripts of the folder `page`, and what it shows.

Nothing in it comes from elsewhere, and its content security policy lets nothing in: one script and
one style, by their hashes, and workers and pictures that the script itself makes.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import html
import json
import re
import struct
from collections.abc import Mapping
from importlib import resources
from types import MappingProxyType
from typing import Any

_IMPORT = re.compile(r'^import \{([^}]*)\} from "\./([a-z_]+)\.js";\n', re.MULTILINE)
_EXPORT = re.compile(r"^export (?=(?:async )?(?:function|class|const) (\w+))", re.MULTILINE)
_FOLDER = resources.files(__package__) / "page"


PAGE = "index.html", "style.css", "main"
SPHERE = "sphere.html", "sphere.css", "sphere"
"""Markup, style, and the module that starts: of the whole viewer, and of one picture."""


def gathered(facts: Mapping[str, Any], parts: Mapping[str, bytes]) -> bytes:
    """JSON and named bytes as the page reads them (`container.js`), gzipped; the same each time."""
    places, start = {}, 0
    for name, content in parts.items():
        places[name] = start, len(content)
        start += len(content)
    text = json.dumps({**facts, "parts": places}, separators=(",", ":")).encode()
    whole = struct.pack("<I", len(text)) + text + b"".join(parts.values())
    return gzip.compress(whole, 9, mtime=0)


def packed(facts: Mapping[str, Any], parts: Mapping[str, bytes]) -> bytes:
    """The same in base64."""
    return base64.b64encode(gathered(facts, parts))


def document(
    title: str,
    facts: Mapping[str, Any],
    parts: Mapping[str, bytes],
    files: tuple[str, str, str] = PAGE,
) -> bytes:
    """The whole page, as UTF-8.

    Parameters
    ----------
    title
        Shown as text, whatever it holds.
    facts, parts
        See :func:`gathered`.
    files
        :data:`PAGE` or :data:`SPHERE`.
    """
    markup, style = ((_FOLDER / name).read_text("utf-8") for name in files[:2])
    code = script(files[2])
    for part in (code, style):
        if re.search("</(script|style)", part, re.IGNORECASE):
            raise ValueError("a script or style would end within itself")
    policy = (
        f"default-src 'none'; script-src '{_hash(code)}' blob:; style-src '{_hash(style)}'; "
        "img-src data: blob:; worker-src blob:; base-uri 'none'; form-action 'none'"
    )
    filled = {
        "POLICY": html.escape(policy),
        "TITLE": html.escape(title),
        "STYLE": style,
        "SCRIPT": code,
        "DATA": packed(facts, parts).decode(),
    }
    return re.sub(r"NACRE_([A-Z]+)", lambda found: filled[found[1]], markup).encode()


def script(first: str, made: Mapping[str, str] = MappingProxyType({})) -> str:
    """A module of the folder with all that it imports, as one script: each in a scope of its own.

    Parameters
    ----------
    first
        Name of the module; what it exports is in the object `of_` and its name.
    made
        Further modules that may be imported, by name.
    """
    ordered: dict[str, str] = {}

    def add(name: str) -> None:
        if name in ordered:
            return
        text = made[name] if name in made else (_FOLDER / f"{name}.js").read_text("utf-8")
        for _, other in _IMPORT.findall(text):
            add(other)
        body = _EXPORT.sub("", _IMPORT.sub(r"const {\1} = of_\2;\n", text))
        exported = ", ".join(_EXPORT.findall(text))
        ordered[name] = f"const of_{name} = (() => {{\n{body}\nreturn {{ {exported} }};\n}})();"

    add(first)
    return "\n".join(ordered.values())


def _hash(text: str) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"
