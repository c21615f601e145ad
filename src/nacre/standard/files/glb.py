"""glTF 2.0 files with one material: writes a sphere that opens anywhere, reads any file.

A `.glb` is a header, a chunk of JSON and a chunk of binary data (glTF 2.0, section 4.4); a `.gltf`
is the JSON alone. Reading uses only the JSON. Colors are linear.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from nacre.brdf import Brdf
from nacre.errors import CUT_SHORT, FormatError
from nacre.io.files import check_json, check_regular, check_size, opened
from nacre.io.format import Format
from nacre.io.names import chosen
from nacre.runtime.progress import Progress
from nacre.standard.files import gltf_material
from nacre.standard.files.facts import FACTS
from nacre.standard.files.sphere import Mesh, sphere
from nacre.standard.fitted import write_fitted
from nacre.standard.gltf import Gltf

_MAGIC, _VERSION = b"glTF", 2
_JSON, _BINARY = 0x4E4F534A, 0x004E4942  # "JSON" and "BIN\0"
_HEADER = struct.Struct("<4s4I")  # magic, version, length; length and kind of the first chunk
_LIMIT = 1 << 24  # bytes of JSON
_FLOAT, _SHORT = 5126, 5123
_VERTICES, _INDICES = 34962, 34963  # targets of buffer views


def encode(brdf: Gltf, mesh: Mesh | None = None) -> bytes:
    """A `.glb` with a mesh, by default a sphere, in a material; the same bytes for the same
    material.

    The metadata, with the fit's errors and the source, are in the material's `extras`, and the
    terms of the source in `asset.copyright`. Raises FormatError if the metadata cannot be written
    as JSON.
    """
    shape = mesh or sphere()
    attributes: dict[str, tuple[Any, str]] = {
        "POSITION": (shape.positions, "VEC3"),
        "NORMAL": (shape.normals, "VEC3"),
        "TANGENT": (shape.tangents, "VEC4"),
        "TEXCOORD_0": (shape.uv, "VEC2"),
    }
    arrays = [*attributes.values(), (shape.triangles.reshape(-1), "SCALAR")]
    views, accessors, parts, start = [], [], [], 0
    for place, (values, kind) in enumerate(arrays):
        data = values.tobytes()
        scalar = kind == "SCALAR"
        target = _INDICES if scalar else _VERTICES
        views.append({"buffer": 0, "byteOffset": start, "byteLength": len(data), "target": target})
        accessor = {
            "bufferView": place,
            "componentType": _SHORT if scalar else _FLOAT,
            "count": len(values),
            "type": kind,
        }
        if place == 0:
            accessor |= {"min": values.min(0).tolist(), "max": values.max(0).tolist()}
        accessors.append(accessor)
        parts.append(data)
        start += len(data)
    binary = b"".join(parts)
    named = {"name": brdf.name} if brdf.name else {}
    material = {**named, **gltf_material.to_json(brdf)}
    if brdf.metadata:
        material["extras"] = {FACTS: dict(brdf.metadata)}
    asset = {"version": "2.0", "generator": "nacre"}
    if terms := (brdf.source or {}).get("terms") or brdf.describe().get("terms of the source"):
        asset["copyright"] = str(terms)
    primitive = {
        "attributes": {name: place for place, name in enumerate(attributes)},
        "indices": len(attributes),
        "material": 0,
    }
    content: dict[str, Any] = {
        "asset": asset,
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, **named}],
        "meshes": [{"primitives": [primitive]}],
        "materials": [material],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(binary)}],
    }
    if extensions := list(material.get("extensions", {})):
        content["extensionsUsed"] = extensions
    return container(content, binary)


def container(content: Mapping[str, Any], binary: bytes) -> bytes:
    """The bytes of a `.glb`; raises FormatError if its JSON cannot be written."""
    try:
        check_json(content)
        text = json.dumps(content, separators=(",", ":"), ensure_ascii=False).encode()
    except (TypeError, ValueError) as error:
        raise FormatError(f"metadata cannot be written as JSON: {error}") from error
    chunks = b""
    for kind, data, padding in ((_JSON, text, b" "), (_BINARY, binary, b"\0")):
        padded = data + padding * (-len(data) % 4)
        chunks += struct.pack("<II", len(padded), kind) + padded
    return struct.pack("<4sII", _MAGIC, _VERSION, 12 + len(chunks)) + chunks


def save(brdf: Brdf, path: Path, progress: Progress | None = None) -> None:
    """Write a sphere in a material, which is fitted if it is not glTF's.

    Raises FormatError if the path is bad, or the model cannot be fitted.
    """
    write_fitted(brdf, Gltf, path, encode, progress)


def load(path: Path, material: str | None = None) -> Gltf:
    """Read a material by its name or its number from any tool's `.glb` or `.gltf`.

    Textures, meshes and buffers that the file refers to are not read. Raises FormatError if the
    file is absent or damaged, has no such material or several of which none is chosen, or one that
    the model cannot hold: with textures, transparency, emission, or other extensions.
    """
    found = _materials(path)
    names = [_name(each) for each in found]
    place = chosen(path, names, material)
    try:
        check_json(found[place])
        return gltf_material.from_json(found[place], names[place], _facts(found[place]))
    except (FormatError, ValueError) as error:
        raise FormatError(
            f"{path}: material {names[place][:40] or place + 1!r}: {error}"
        ) from error


def _materials(path: Path) -> list[Any]:
    text = _text(path)
    try:
        content = json.loads(text.decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise FormatError(f"{path}: is not whole JSON: {error}") from error
    found = content.get("materials") if isinstance(content, dict) else None
    if not isinstance(found, list) or not found:
        raise FormatError(f"{path}: has no materials")
    return found


def _name(material: Any) -> str:
    name = material.get("name") if isinstance(material, dict) else None
    return name if isinstance(name, str) and name.isprintable() else ""


def _facts(material: Any) -> dict[str, Any]:
    """What :func:`encode` stored; nothing from other tools."""
    extras = material.get("extras") if isinstance(material, dict) else None
    noted = extras.get(FACTS) if isinstance(extras, dict) else None
    if not isinstance(noted, dict):
        return {}
    known = [noted.get(part, {}) for part in ("fit", "source")]
    return noted if all(isinstance(part, dict) for part in known) else {}


def _text(path: Path) -> bytes:
    """The JSON of either kind of file."""
    with opened(path) as file:
        size = check_regular(Path(path))
        head = file.read(_HEADER.size)
        if not head.startswith(_MAGIC):
            check_size(Path(path), _LIMIT)
            return head + file.read()
        if len(head) < _HEADER.size:
            raise FormatError(f"{path}: ends within the header; {CUT_SHORT}")
        _, version, total, length, kind = _HEADER.unpack(head)
        if (version, kind) != (_VERSION, _JSON):
            raise FormatError(f"{path}: is not glTF 2.0: version {version}, first chunk {kind:#x}")
        if total != size or length > total - _HEADER.size:
            raise FormatError(f"{path}: has {size} of {total} bytes; {CUT_SHORT}")
        if length > _LIMIT:
            raise FormatError(f"{path}: {length} bytes of JSON, more than the {_LIMIT} read")
        return file.read(length)


def _recognize(head: bytes) -> bool:
    if head.startswith(_MAGIC):
        return True
    marks = (b'"asset"', b'"materials"', b'"extensionsUsed"', b'"accessors"', b'"scenes"')
    return head.lstrip().startswith(b"{") and any(mark in head for mark in marks)


FORMAT = Format(
    "glTF",
    (".glb", ".gltf"),
    _recognize,
    load,
    save,
    materials=lambda path: [_name(each) for each in _materials(path)],
    model="gltf",
    measured=False,
)
