"""glTF files with one material, binary and as JSON."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterable
from random import Random
from typing import Any, cast

from nacre.standard.files import gltf_material
from nacre.standard.files.glb import container, encode
from nacre.standard.gltf import Gltf
from tests.analytic.materials import EXAMPLES
from tests.specimens.specimen import NUMBERS, Specimen, odd_json, packed, replaced

_BRDF = cast(Gltf, EXAMPLES["gltf-anisotropic"])


def _content() -> dict[str, Any]:
    material = {"name": "paint", **gltf_material.to_json(_BRDF)}
    return {"asset": {"version": "2.0"}, "materials": [material]}


def _files() -> list[bytes]:
    return [encode(_BRDF), container(_content(), b""), json.dumps(_content()).encode()]


def _sized(number: int) -> Iterable[bytes]:
    data = container(_content(), bytes(8))
    true = {place: struct.unpack_from("<I", data, place)[0] for place in (8, 12)}
    for place, size in true.items():
        if number % (1 << 32) != size:
            yield replaced(data, place, packed(number, 4))


def _places(content: Any) -> Iterable[tuple[Any, Any]]:
    """Containers and keys of all numbers."""
    for key, value in content.items() if isinstance(content, dict) else enumerate(content):
        if isinstance(value, dict | list):
            yield from _places(value)
        elif isinstance(value, float):
            yield content, key


def _valued(value: float) -> Iterable[bytes]:
    for place in range(len(list(_places(_content())))):
        content = _content()
        holder, key = list(_places(content))[place]
        holder[key] = value
        yield container_of(content)


def container_of(content: Any) -> bytes:
    """A `.glb` of any JSON, also of what no file may have."""
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _rebuilt(_: bytes, random: Random) -> bytes:
    content = _content()
    for _change in range(random.choice((1, 1, 2, 3))):
        holder: Any = content
        while True:
            key = random.choice(list(holder) if isinstance(holder, dict) else range(len(holder)))
            inner = holder[key]
            if not isinstance(inner, dict | list) or not inner or random.random() < 0.15:
                break
            holder = inner
        choice = random.random()
        if choice < 0.5 and isinstance(inner, float):
            holder[key] = random.choice((0.0, 1.0, 1e-9, random.random(), *NUMBERS))
        elif choice < 0.9:
            holder[key] = odd_json(random)
        elif isinstance(holder, dict):
            holder[random.choice(("normalTexture", "extensions", "extras", "x"))] = inner
    if random.random() < 0.3:
        return json.dumps(content).encode()
    return container_of(content)


SPECIMENS = {
    "glTF": Specimen("paint.glb", _files, header=20, sized=_sized, valued=_valued, rebuild=_rebuilt)
}
