"""OpenPBR surfaces in files of MaterialX and of USD."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from random import Random
from typing import Any

from nacre.analytic import AnalyticBrdf
from nacre.standard.files import materialx, usda
from tests.analytic.materials import EXAMPLES
from tests.specimens.specimen import NUMBERS, VALUES, Specimen

SOURCE = {"fit": {"samples": 3}, "source": {"file": "a", "sha256": "b", "terms": "<free> & 'open'"}}


def brdfs() -> list[AnalyticBrdf]:
    """A material of each model, with facts on where it is from."""
    return [
        type(brdf)(name="paint", metadata=SOURCE, **dict[str, Any](brdf.values))
        for brdf in (EXAMPLES["openpbr"], EXAMPLES["openpbr-anisotropic"])
    ]


def _whole(encode: Callable[..., bytes]) -> list[bytes]:
    return [encode(brdf) for brdf in brdfs()]


def _valued(encode: Callable[..., bytes], number: re.Pattern[str], value: float) -> Iterable[bytes]:
    """Files with one number of the surface replaced, every fourth of them."""
    for content in _whole(encode):
        text = content.decode()
        for found in list(number.finditer(text))[::4]:
            yield (text[: found.start(1)] + repr(value) + text[found.end(1) :]).encode()


def _rebuilt(words: tuple[str, ...]) -> Callable[[bytes, Random], bytes]:
    def rebuilt(content: bytes, random: Random) -> bytes:
        """A file some words of which are those of others, or odd ones."""
        parts = re.split(r"(\w[\w.:]*)", content.decode(errors="replace"))
        odd = [*words, *map(str, NUMBERS), *map(str, VALUES), "x" * 300, "é", "", "\0", "1_0"]
        for _ in range(random.choice((1, 1, 2, 5))):
            place = random.randrange(len(parts))
            parts[place] = random.choice([*odd, random.choice(parts)])
        return "".join(parts).encode()

    return rebuilt


GRAPHS = b"""<?xml version="1.0"?>
<materialx version="1.39" colorspace="acescg">
  <nodedef name="ND_half" node="half">
    <input name="of" type="float" value="0.8" /><output name="out" type="float" />
  </nodedef>
  <nodegraph name="NG_half" nodedef="ND_half">
    <multiply name="m" type="float">
      <input name="in1" type="float" interfacename="of" />
      <input name="in2" type="float" value="0.5" />
    </multiply>
    <output name="out" type="float" nodename="m" />
  </nodegraph>
  <nodegraph name="g">
    <input name="tint" type="color3" value="0.5, 0.25, 0.75" />
    <constant name="c" type="color3"><input name="value" type="color3" value="0.5, 0.4, 0.3" />
    </constant>
    <mix name="m" type="color3">
      <input name="fg" type="color3" nodename="c" />
      <input name="bg" type="color3" interfacename="tint" />
      <input name="mix" type="float" value="0.5" />
    </mix>
    <output name="out" type="color3" nodename="m" />
  </nodegraph>
  <half name="h" type="float"><input name="of" type="float" value="0.6" /></half>
  <CATEGORY name="s" type="surfaceshader">
    <input name="COLOR" type="color3" nodegraph="g" output="out" />
    <input name="METAL" type="float" nodename="h" />
  </CATEGORY>
  <surfacematerial name="paint" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="s" />
    <input name="displacementshader" type="displacementshader" value="" />
  </surfacematerial>
</materialx>
"""
"""A document with constants behind nodes, an interface and a node of its own."""

_CATEGORIES = {
    "standard_surface": ("base_color", "metalness"),
    "gltf_pbr": ("base_color", "metallic"),
    "UsdPreviewSurface": ("diffuseColor", "metallic"),
    "disney_principled": ("baseColor", "metallic"),
}


def _documents() -> list[bytes]:
    """One of each surface."""
    found = _whole(materialx.encode)
    for category, names in _CATEGORIES.items():
        words = zip((b"CATEGORY", b"COLOR", b"METAL"), (category, *names), strict=True)
        content = GRAPHS
        for word, name in words:
            content = content.replace(word, name.encode())
        found.append(content)
    return found


_XML_NUMBER = re.compile(r'<input name="\w+" type="(?:float|color3)" value="([^",]+)')
_XML_WORDS = (
    *("nodename", "nodegraph", "colorspace", "unit", "interfacename", "srgb_texture", "acescg"),
    *("standard_surface", "surfaceshader", "transmission_weight", "emission_color", "boolean"),
    *('<!DOCTYPE a [<!ENTITY b "c">]>', "&b;", "<![CDATA[", "<a>" * 5000, "<!--", "0.1, 0.2"),
    *("xi:include", "{}", "[[]]", "null", "&quot;", "true", "divide", "switch", "swizzle", "in1"),
    *(
        "gltf_pbr",
        "subsurface",
        "image",
        "version",
        "1.0.0",
        "channels",
        "rgb",
        "vector3",
        "noise3d",
    ),
    *("surfacematerial", "output", "nodedef", "rotate3d", "lin_ciexyzd65_scene", "acescc"),
)

_USD_NUMBER = re.compile(r"(?:float|color3f) inputs:\w+_\w+ = \(?([^,)\n]+)")
_USD_WORDS = (
    *("def", "over", "variantSet", "Material", "Shader", "UsdPreviewSurface", "rel", "prepend"),
    *("inputs:transmission_weight", "inputs:base_color.timeSamples", "inputs:geometry_normal"),
    *('"""', "@@@", "@a.usda@", "</a/b.outputs:out>", "</>", "(" * 100, "[" * 5000, "{", "}", "()"),
    *('def A "a" {' * 100, "\\", "'", "nan", "-inf", "1e999", "#", ";", "None", '{"a": 1}'),
)

SPECIMENS = {
    "USD (text)": Specimen(
        "paint.usda",
        lambda: _whole(usda.encode),
        header=100,
        sized=lambda _: [],
        valued=lambda value: _valued(usda.encode, _USD_NUMBER, value),
        rebuild=_rebuilt(_USD_WORDS),
        text=True,
    ),
    "MaterialX": Specimen(
        "paint.mtlx",
        _documents,
        header=100,
        sized=lambda _: [],
        valued=lambda value: _valued(materialx.encode, _XML_NUMBER, value),
        rebuild=_rebuilt(_XML_WORDS),
        text=True,
    ),
}
