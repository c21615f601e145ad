"""USD layers as text (`.usda`) that hold one OpenPBR surface.

On a sphere, a UsdShade material with MaterialX's node (`outputs:mtlx:surface`) and, for viewers
that know nothing else, a UsdPreviewSurface close to it (`outputs:surface`). OpenUSD, schemas
UsdShade and UsdMtlx; "UsdPreviewSurface Specification" 2.6.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from pathlib import Path as FilePath
from typing import Any

from nacre.brdf import Brdf
from nacre.errors import FormatError
from nacre.io.files import read_bytes
from nacre.io.format import Format
from nacre.runtime.progress import Progress
from nacre.standard.files.color_spaces import to_rec_709
from nacre.standard.files.facts import FACTS, about, facts_of, node_name
from nacre.standard.files.opaque_part import OpaquePart
from nacre.standard.files.openpbr_inputs import (
    KINDS,
    NODE_DEFINITION,
    TANGENTS,
    Input,
    read,
)
from nacre.standard.files.usda_text import Path, Prim, Property, parse, quoted
from nacre.standard.fitted import write_fitted
from nacre.standard.openpbr import OpenPbr

_LIMIT = 1 << 18
_RADIUS = 0.1  # of the sphere, in meters
_OUTPUT = "outputs:mtlx:surface"
_TURN = {"in": "ND_tangent_vector3", "axis": "ND_normal_vector3"}
"""Nodes behind a rotated tangent, by the inputs of ND_rotate3d_vector3."""

_LAYER = """\
#usda 1.0
(
    defaultPrim = "{name}"
    doc = {about}
    metersPerUnit = 1
    upAxis = "Z"
)

def Xform "{name}" (
    kind = "component"
)
{{
    def Sphere "sphere" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {{
        float3[] extent = [({low}, {low}, {low}), ({high}, {high}, {high})]
        double radius = {high}
        rel material:binding = </{name}/materials/{name}>
    }}

    def Scope "materials"
    {{
        def Material "{name}" (
            prepend apiSchemas = ["MaterialXConfigAPI"]
            customData = {{
                string {key} = {facts}
                string about = {about}
            }}
        )
        {{
            uniform string config:mtlx:version = "1.39"
            token outputs:mtlx:surface.connect = </{name}/materials/{name}/openpbr.outputs:out>
            token outputs:surface.connect = </{name}/materials/{name}/preview.outputs:surface>
{shaders}
        }}
    }}
}}
"""


def encode(brdf: OpenPbr) -> bytes:
    """A layer with a material; every number survives exactly.

    Raises FormatError if the metadata cannot be written.
    """
    name = node_name(brdf.name)
    own = f"/{name}/materials/{name}"
    values: dict[str, Any] = dict(brdf.values)
    angle = values.pop("angle", None)
    inputs = [_line(f"inputs:{key}", value) for key, value in values.items()]
    shaders = []
    if angle is not None:
        inputs += [_link(f"inputs:{each}", f"{own}/turned") for each in TANGENTS]
        # MaterialX turns from y toward x.
        lines = [_link(f"inputs:{each}", f"{own}/{each}") for each in _TURN]
        lines.append(_line("inputs:amount", -math.degrees(angle)))
        shaders.append(_shader("turned", "ND_rotate3d_vector3", lines, "float3 outputs:out"))
        world = 'string inputs:space = "world"'
        for each, node in _TURN.items():
            shaders.append(_shader(each, node, [world], "float3 outputs:out"))
    shaders.append(_shader("openpbr", NODE_DEFINITION, inputs, "token outputs:out"))
    shown = [_line(f"inputs:{key}", value) for key, value in preview(brdf).items()]
    shaders.append(_shader("preview", "UsdPreviewSurface", shown, "token outputs:surface"))
    text = _LAYER.format(
        name=name,
        about=quoted(about(brdf)),
        low=-_RADIUS,
        high=_RADIUS,
        key=FACTS,
        facts=quoted(facts_of(brdf)),
        shaders="\n".join(shaders),
    )
    return text.encode()


def _line(name: str, value: Any) -> str:
    if isinstance(value, tuple):
        return f"color3f {name} = ({', '.join(map(repr, value))})"
    return f"float {name} = {value!r}"


def _link(name: str, prim: str) -> str:
    return f"float3 {name}.connect = <{prim}.outputs:out>"


def _shader(name: str, node: str, lines: Iterable[str], output: str) -> str:
    body = [f'uniform token info:id = "{node}"', *lines, output]
    inner = "".join(f"                {line}\n" for line in body)
    return f'\n            def Shader "{name}"\n            {{\n{inner}            }}'


def preview(brdf: OpenPbr) -> Mapping[str, Input]:
    """Inputs of a similar UsdPreviewSurface: base, dielectric and coat.

    It has no sheen, film, reflection tint or anisotropy.
    """
    values: Mapping[str, Any] = brdf.values
    through = values["coat_weight"]
    color = tuple(
        values["base_weight"] * base * (1.0 + through * (tint - 1.0))
        for base, tint in zip(values["base_color"], values["coat_color"], strict=True)
    )
    ior = values["specular_ior"]
    root = math.sqrt(values["specular_weight"]) * (ior - 1.0) / (ior + 1.0)
    return {
        "diffuseColor": (color[0], color[1], color[2]),
        "metallic": values["base_metalness"],
        "roughness": values["specular_roughness"],
        "ior": (1.0 + root) / (1.0 - root),
        "clearcoat": values["coat_weight"],
        "clearcoatRoughness": values["coat_roughness"],
    }


def save(brdf: Brdf, path: FilePath, progress: Progress | None = None) -> None:
    """Write a material; other models are fitted on pictures.

    Raises FormatError if the path is bad, or the model cannot be fitted.
    """
    write_fitted(brdf, OpenPbr, path, encode, progress)


def load(path: FilePath, opaque_part: bool = False) -> OpenPbr:
    """Read the only OpenPBR surface in a layer.

    With `opaque_part`, transmission, subsurface scattering (which becomes diffuse), emission and
    opacity are left out, and the material's notes say so. Raises FormatError with the prim, the
    input and the fix, if there is none or another surface, or an input is not constant, out of
    bounds, or in an unknown color space.
    """
    data = read_bytes(path, _LIMIT)
    if data.startswith(b"PXR-USDC"):
        raise FormatError(f"{path}: is a binary layer; convert it to text with usdcat (-o x.usda)")
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise FormatError(f"{path}: byte {error.start} is not UTF-8 text") from error
    if not text.startswith("#usda 1."):
        raise FormatError(f"{path}: does not begin with #usda 1.0")
    try:
        opaque = OpaquePart(opaque_part)
        brdf = _Material(dict(parse(text).walk())).brdf(opaque)
        return brdf.replaced(notes=tuple(opaque.notes))
    except FormatError as error:
        raise FormatError(f"{path}: {error}") from error


class _Material:
    """The only material in a layer."""

    def __init__(self, prims: Mapping[str, Prim]) -> None:
        self.prims = prims
        found = {path: prim for path, prim in prims.items() if prim.kind == "Material"}
        if len(found) != 1:
            names = ", ".join(path[:60] for path in list(found)[:5])
            raise FormatError(f"has {len(found)} materials ({names}); one is read")
        ((self.path, self.prim),) = found.items()

    def brdf(self, opaque: OpaquePart) -> OpenPbr:
        shader = self._connected(self.prim, _OUTPUT) or self._connected(
            self.prim, "outputs:surface"
        )
        node = "nothing that is here" if shader is None else _node(shader)
        if shader is None or node != NODE_DEFINITION:
            raise FormatError(
                f"{self.path[:60]}: its surface is {node[:60]}; only {NODE_DEFINITION} is read, so "
                f"connect one to {_OUTPUT}"
            )
        inputs: dict[str, Input] = {}
        angles: dict[str, float] = {}
        for name, found in shader.properties.items():
            plain, _, suffix = name.removeprefix("inputs:").partition(".")
            field = f"{shader.name[:40]}: {plain[:40]}"
            if not name.startswith("inputs:"):
                continue
            if plain in TANGENTS and suffix == "connect":
                angles[plain] = self._angle(shader, name.removesuffix(".connect"))
            elif suffix:
                raise FormatError(f"{field}: has {suffix[:40]}; bake it to a constant")
            elif plain in KINDS:
                inputs[plain] = _value(field, found, KINDS[plain])
            else:
                problem = "is not read" if plain.startswith("geometry_") else "is not known"
                raise FormatError(f"{field}: {problem}; remove it")
        if len(set(angles.values())) > 1 or len(angles) == 1:
            raise FormatError(f"{' and '.join(TANGENTS)}: are not the same; make them equal")
        data = self.prim.metadata.get("customData", {})
        facts = data.get(FACTS) if isinstance(data, dict) else None
        angle = next(iter(angles.values()), None)
        return read(inputs, angle, facts if isinstance(facts, str) else None, opaque)

    def _connected(self, prim: Prim, name: str) -> Prim | None:
        """The prim that an input or output of another is connected to."""
        found = prim.properties.get(f"{name}.connect")
        target = found.value if found else None
        return self.prims.get(target.text.partition(".")[0]) if isinstance(target, Path) else None

    def _angle(self, shader: Prim, name: str) -> float:
        """Angle of a tangent that a node turns about the normal."""
        turned = self._connected(shader, name)
        if turned is not None and _node(turned) == "ND_rotate3d_vector3":
            sources = {each: self._connected(turned, f"inputs:{each}") for each in _TURN}
            amount = turned.properties.get("inputs:amount")
            known = all(p is not None and _node(p) == _TURN[k] for k, p in sources.items())
            if known and amount is not None and isinstance(amount.value, float):
                return -math.radians(amount.value)
        problem = "is not a tangent that ND_rotate3d_vector3 turns by a constant about the normal"
        raise FormatError(f"{shader.name[:40]}: {name.removeprefix('inputs:')}: {problem}")


def _node(shader: Prim) -> str:
    """Identifier of a shader's node."""
    found = shader.properties.get("info:id")
    return found.value if found and isinstance(found.value, str) else f"a {shader.kind}"


def _value(field: str, found: Property, kind: type) -> Input:
    value = found.value
    if kind is float and isinstance(value, float):
        return value
    color = isinstance(value, tuple) and len(value) == 3
    if kind is tuple and color and all(isinstance(c, float) for c in value):
        space = str(found.metadata.get("colorSpace", ""))
        try:
            red, green, blue = to_rec_709(value, space).tolist()
        except FormatError as error:
            raise FormatError(f"{field}: {error}") from error
        return red, green, blue
    wanted = "a color of three numbers" if kind is tuple else "one number"
    raise FormatError(f"{field}: is not {wanted}, but {str(value)[:40]!r}")


FORMAT = Format(
    "USD (text)",
    (".usda", ".usd"),
    lambda head: head.startswith((b"#usda ", b"PXR-USDC")),
    load,
    save,
    model="openpbr",
    measured=False,
)
