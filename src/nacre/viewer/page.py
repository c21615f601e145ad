"""The page as one file: markup, style and scripts from the folder `page`, and its content.

The page makes no requests, and its content security policy allows none: one style and two scripts
by their hashes, of which the first unpacks the second, and workers, pictures and WebAssembly that
it makes. Only a page whose content is in several files may load those, as scripts that its own
script asks for.
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
"""Markup, style, and main module: for the whole viewer, and for one picture."""


def gathered(facts: Mapping[str, Any], parts: Mapping[str, bytes]) -> bytes:
    """JSON and named bytes in the page's format (`container.js`), gzipped; the same each time."""
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


def _base64(content: bytes) -> str:
    return base64.b64encode(gzip.compress(content, 9, mtime=0)).decode()


def document(
    title: str,
    facts: Mapping[str, Any],
    parts: Mapping[str, bytes],
    files: tuple[str, str, str] = PAGE,
) -> bytes:
    """The whole page, as UTF-8, with facts and parts as in :func:`gathered`.

    The title is shown as text, whatever it contains; `files` is :data:`PAGE` or :data:`SPHERE`.
    """
    markup, style = ((_FOLDER / name).read_text("utf-8") for name in files[:2])
    boot, code = script("boot"), script(files[2])
    for part in (boot, style):
        if re.search("</(script|style)", part, re.IGNORECASE):
            raise ValueError("a script or style would end within itself")
    others = "blob: 'wasm-unsafe-eval'" + (" 'strict-dynamic'" if "more" in facts else "")
    policy = (
        f"default-src 'none'; script-src '{_hash(boot)}' '{_hash(code)}' {others}; "
        f"style-src '{_hash(style)}'; "
        "img-src data: blob:; worker-src blob:; base-uri 'none'; form-action 'none'"
    )
    filled = {
        "POLICY": html.escape(policy),
        "TITLE": html.escape(title),
        "STYLE": style,
        "BOOT": boot,
        "CODE": _base64(code.encode()),
        "DATA": packed(facts, parts).decode(),
    }
    return re.sub(r"NACRE_([A-Z]+)", lambda found: filled[found[1]], markup).encode()


def script(first: str, made: Mapping[str, str] = MappingProxyType({})) -> str:
    """A module from the folder with all its imports, as one script with a scope for each module.

    The exports of `first` are in the object named `of_` and its name. `made` are further modules
    that may be imported, by name.
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
