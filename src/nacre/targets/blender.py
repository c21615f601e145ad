"""Blender: closure mixtures and Principled materials, by a script or by the add-on."""

from __future__ import annotations

import ast
import io
import json
import textwrap
import zipfile
from collections.abc import Mapping
from importlib import resources
from typing import Any

from nacre.analytic import AnalyticBrdf
from nacre.analytic.file import encode
from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.targets.target import Target
from nacre.targets.text import facts

ADDON = "nacre_blender.zip"
"""Name of the add-on's file."""

_FOLDER = "nacre_materials"
"""The folder in the zip, with which Blender takes it as an extension and as an old add-on alike."""
_TIME = (1980, 1, 1, 0, 0, 0)  # of members: the same add-on is the same file

_SCRIPT = '''
MATERIAL = (
{text}
)
"""The material, as the add-on reads it from a file."""

if __name__ == "__main__":
    {call}
'''


def addon() -> bytes:
    """The source of the add-on, a single module for Blender 4.2 to 5."""
    about = [
        "Materials of nacre in Blender.",
        "",
        "Edit > Preferences > Add-ons > Install from Disk takes the zip that this is in; then File",
        "> Import > nacre material.",
    ]
    return assembled(about, "reading", "nodes", "asset", "library", "interface").encode()


def extension() -> bytes:
    """The add-on as a zip for Blender 4.2 to 5, with its manifest."""
    manifest = resources.files("nacre.targets").joinpath("blender_addon", "blender_manifest.toml")
    files = {"blender_manifest.toml": manifest.read_bytes(), "__init__.py": addon()}
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        for name, data in files.items():
            member = zipfile.ZipInfo(f"{_FOLDER}/{name}", _TIME)
            archive.writestr(member, data, zipfile.ZIP_DEFLATED)
    return stream.getvalue()


class BlenderClosures(Target):
    title = "Blender: a script that makes a material of closures"
    model = "closures"

    def files(self, material: Brdf | Btf, name: str) -> Mapping[str, bytes]:
        given = content(self.of_model(material), name)
        about = [
            *facts(material).values(),
            "",
            "Blender 4.2 to 5: open in a text editor of Blender and run; it adds a material.",
        ]
        call = f'build(read(MATERIAL, "{name}"))'
        return {f"{name}.py": script(about, ("reading", "nodes"), call, given)}


class BlenderAddon(Target):
    title = "Blender: an add-on, and the material as a file for it"
    model = "closures"

    def files(self, material: Brdf | Btf, name: str) -> Mapping[str, bytes]:
        given = content(self.of_model(material), name)
        return {ADDON: extension(), f"{name}.json": f"{json.dumps(given, indent=1)}\n".encode()}


class PrincipledScript(Target):
    title = "Blender: a script that makes an asset of the Principled node"
    model = "principled"

    def files(self, material: Brdf | Btf, name: str) -> Mapping[str, bytes]:
        """See :class:`nacre.targets.target.Target`; what is no Principled material is fitted."""
        found = self.of_model(material)
        about = [
            *facts(found).values(),
            "",
            "Blender 4.2 to 5: blender --python this file, or open it in the text editor and run.",
            "A material is added as an asset; one that this added before gets its values again.",
        ]
        pieces = "reading", "nodes", "asset"
        call = f'make_asset(read(MATERIAL, "{name}"))'
        return {f"{name}.py": script(about, pieces, call, content(found, name))}


def content(brdf: AnalyticBrdf, name: str) -> dict[str, Any]:
    """An analytic material in the add-on's file format, with facts about its source."""
    found: dict[str, Any] = json.loads(encode(brdf))
    found["name"] = found["name"] or name
    if brdf.source:
        found["metadata"]["source"] = found["metadata"].get("source", {}) | dict(brdf.source)
    return found


def script(about: list[str], pieces: tuple[str, ...], call: str, given: dict[str, Any]) -> bytes:
    """A script from modules of the add-on that calls one of their functions.

    `about` are lines of its docstring; `call` may use `MATERIAL`, the text of the material.
    """
    text = json.dumps(given)
    lines = [text[k : k + 80] for k in range(0, len(text), 80)]
    shown = textwrap.indent("\n".join(map(repr, lines)), "    ")
    return (assembled(about, *pieces) + _SCRIPT.format(text=shown, call=call)).encode()


def assembled(about: list[str], *pieces: str) -> str:
    """Modules from the folder `blender_addon`, in order of use, joined into one.

    Blender's Python does not have this package: what pieces import from each other stands above.
    """
    imports: set[str] = set()
    bodies = []
    for piece in pieces:
        path = resources.files("nacre.targets").joinpath("blender_addon", f"{piece}.py")
        source = path.read_text("utf-8")
        lines = source.splitlines()
        head, *statements = ast.parse(source).body
        cut = [head]
        for node in statements:
            if isinstance(node, ast.Import | ast.ImportFrom):
                cut.append(node)
                if not getattr(node, "module", "").startswith("nacre."):
                    imports.add(ast.unparse(node))
        for node in reversed(cut):
            del lines[node.lineno - 1 : node.end_lineno]
        bodies.append("\n".join(lines).strip())
    begin = "\n".join(['"""' + about[0], *about[1:], '"""'])
    return "\n\n\n".join([f"{begin}\n\n" + "\n".join(sorted(imports)), *bodies]) + "\n"
