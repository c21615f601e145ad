"""Encoded textures in shading languages: functions, and the arrays that they read."""

from __future__ import annotations

import math
import string
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from nacre.array import Array, Components, Floats
from nacre.brdf import Brdf, pdf_formula, sample_formula
from nacre.btf import Btf
from nacre.io.ktx2 import Pixels
from nacre.sampling.tilted import TiltedMixture
from nacre.targets.program import Function
from nacre.targets.source import Language, SourceTarget
from nacre.targets.text import preamble
from nacre.targets.textures.accuracy import error_lines
from nacre.targets.textures.atlas import CHROMA_LAYERS, LUMA_LAYERS
from nacre.targets.textures.code import ATLAS, FILTERED, LEVEL, LOBES, PARALLAX, Code
from nacre.targets.textures.filtered import FUNCTIONS, FilteredTexture
from nacre.targets.textures.shader_texture import ShaderTexture
from nacre.targets.textures.target import TextureTarget
from nacre.textures.codecs.basis.colors import join_components
from nacre.textures.factors import grid_place

_TYPES = {"float": (1, "f"), "int": (1, "i"), "uint": (1, "u")} | {
    f"{prefix}vec{count}": (count, kind)
    for prefix, kind in (("", "f"), ("i", "i"))
    for count in (2, 3, 4)
}
_CONVENTIONS = (
    "uv: u grows to the right and v down, from 0 to 1 over the texture, which repeats.",
    "level: 0 for texels, 1 for means of two by two, and so on; NAME_level gives it.",
    "wi, wo: x along u, y against v, z the normal.",
)
_WIDE_STRIP = "$ivec2($width_i - ($width_i >> $uint(level - 1)), $height_i)"
_TALL_STRIP = "$ivec2($width_i, $height_i - ($height_i >> $uint(level - 1)))"
"""Where levels start; see :func:`nacre.targets.textures.atlas.level_origin`."""


@dataclass(frozen=True)
class Dialect:
    """A shading language's names for types, and how it reads textures.

    Parameters
    ----------
    type_name
        From a count of numbers and their kind, "f", "i" or "u"; see :data:`_TYPES`.
    fetch, array, picture
        Expressions: the pixel `at` in a `layer` of a `texture`; what its sampler gives at `at`
        between pixels; the same for a texture without layers, between pixels of a `level`.
    textures
        Declarations of textures, from the material's name and the pixels by name: arrays have four
        axes, pictures three.
    functions
        Functions with other names, by their names in the code.
    let, var
        The keywords that declare a constant and a variable; by default their type.
    """

    type_name: Callable[[int, str], str]
    fetch: str
    array: str
    picture: str
    textures: Callable[[str, Mapping[str, Pixels]], Sequence[str]]
    functions: Mapping[str, str]
    let: str | None = None
    var: str | None = None

    def names(self) -> dict[str, str]:
        """Replacements for `$name` in :mod:`nacre.targets.textures.code`."""
        found = dict(self.functions)
        for name, of in _TYPES.items():
            text = self.type_name(*of)
            found[name] = text
            found[f"let_{name}"] = self.let or text
            found[f"var_{name}"] = self.var or text
        return found


def texture_source(
    atlas: ShaderTexture, name: str, language: Language, dialect: Dialect, head: Sequence[str]
) -> str:
    """The functions of a texture, after comment lines."""
    arrays = {each: levels[0] for each, levels in atlas.textures().items()}
    prefix = f"{name}_"
    names = dialect.names() | _numbers(atlas, language)
    wide = atlas.width >= atlas.height
    names["strip"] = string.Template(_WIDE_STRIP if wide else _TALL_STRIP).substitute(names)
    filtered = atlas if isinstance(atlas, FilteredTexture) else None
    names["sums"] = _sums(filtered, language, names["vec4"]) if filtered else ""

    flat, between = {"at": "vec2"}, {"at": "vec2", "level": "float"}
    reads = {
        "weights": Code("weights_at", "vec4", {"at": "ivec2", "layer": "int"}, dialect.fetch),
        "functions": Code("tile_at", "vec4", {"at": "vec2", "layer": "int"}, dialect.array),
        "lobes": Code("lobe_at", "vec4", flat, dialect.picture),
        "heights": Code("height_at", "float", flat, f"{dialect.picture}.x"),
    }
    for each in atlas.weights_by_name() if filtered else ():
        reads[each] = Code(f"{each}_at", "vec4", between, dialect.picture)
    reading = [
        replace(read, body=f"    return {_expression(read, prefix + each, name)};")
        for each, read in reads.items()
        if each in arrays
    ]
    reading += [*LEVEL, *(FILTERED if filtered else ATLAS), *LOBES]
    reading += [PARALLAX] if atlas.heights else []

    def written(code: Code) -> str:
        parameters = ", ".join(
            language.parameter(names[kind], each) for each, kind in code.parameters.items()
        )
        body = string.Template(code.body).substitute(names)
        opening = language.head(names[code.kind], prefix + code.name, parameters)
        return f"{opening} {{\n{body}\n}}".replace("@", prefix)

    formulas = [language.function(each, prefix + each.name) for each in _formulas(atlas)]
    top = "\n".join(
        [*language.comments(head), *language.opening(), "", *dialect.textures(name, arrays)]
    )
    return "\n\n".join([top, *formulas, *map(written, reading)]) + "\n"


def _expression(read: Code, texture: str, name: str) -> str:
    level = "level" if "level" in read.parameters else "0.0"
    return read.body.format(texture=texture, name=name, level=level)


def _sums(texture: FilteredTexture, language: Language, vector: str) -> str:
    """Statements that add what each texture of weights contributes."""

    def numbers(row: Floats) -> str:
        return f"{vector}({', '.join(language.literal(float(value)) for value in row)})"

    return "\n".join(
        f"    roots += @sums(@weights{k}_at(uv, level) * {numbers(span)} + {numbers(low)}, "
        f"tile, between, {1 + FUNCTIONS * k});"
        for k, (span, low) in enumerate(zip(texture.span, texture.low, strict=True))
    )


def _formulas(atlas: ShaderTexture) -> list[Function]:
    """The functions that are formulas on numbers: places in the grid, colors, and lobes."""

    def place(w: Components) -> tuple[tuple[Array, Array]]:
        return (grid_place(w, atlas.resolution),)

    return [
        Function.of("place", place, {"w": 3}, ("place",)),
        Function.of("joined", joined, {"sums": 3}, ("rgb",)),
        Function.of("lobe_pdf", density, {"lobe": 4, "wi": 3, "wo": 3}, ("pdf",)),
        Function.of("lobe_sample", drawn, {"lobe": 4, "wo": 3, "u": 3}, ("wi", "pdf")),
    ]


def joined(sums: Components) -> tuple[Components]:
    """Reflectance factors from a sum for luma and sums for both chroma values."""
    return (join_components(*sums),)


def density(lobe: Sequence[Array], wi: Components, wo: Components) -> tuple[Array]:
    """Density of a lobe with four numbers."""
    return pdf_formula(_mixture(lobe), wi, wo)


def drawn(lobe: Sequence[Array], wo: Components, u: Components) -> tuple[Components, Array]:
    """Direction to the light that a lobe draws, and its density."""
    return sample_formula(_mixture(lobe), wo, u)


def _mixture(lobe: Sequence[Array]) -> TiltedMixture:
    fraction, roughness, x, y = lobe
    return TiltedMixture(fraction, roughness, (x, y))


def _numbers(atlas: ShaderTexture, language: Language) -> dict[str, str]:
    """Numbers of an atlas, as literals by name."""
    height, width, resolution = atlas.height, atlas.width, atlas.resolution
    floats = {
        "width": width,
        "height": height,
        "last": atlas.levels - 1,
        "most": resolution - 1,
        "resolution": resolution,
        "tile": 1.0 / resolution,
        "pixel": 1.0 / resolution**2,
        "inverse_pi": 1.0 / math.pi,
    }
    field = atlas.heights
    if field is not None:
        pixels = field.pixels
        rows, columns, _ = pixels.shape
        bottom, top = float(pixels.min()), float(pixels.max())
        floats |= {"bottom": bottom, "top": top, "span": top - bottom}
        floats |= {"rows": rows, "columns": columns, "aspect": width / height}
    integers = {
        "width_i": width,
        "height_i": height,
        "last_i": atlas.levels - 1,
        "luma": LUMA_LAYERS,
        "chroma": CHROMA_LAYERS,
    }
    return {key: language.literal(value) for key, value in floats.items()} | {
        key: str(value) for key, value in integers.items()
    }


class TextureSourceTarget(TextureTarget, SourceTarget):
    """A target for functions that also takes encoded textures.

    These become a file with functions `NAME_eval`, `NAME_sample`, `NAME_pdf`, `NAME_level`, and
    arrays in KTX 2.0 files.
    """

    dialect: ClassVar[Dialect]
    texture_language: ClassVar[Language | None] = None
    """For textures, if it differs from the :attr:`language` for reflectances."""

    def reflectance_files(self, brdf: Brdf, name: str) -> Mapping[str, bytes]:
        return SourceTarget.files(self, brdf, name)

    def texture_files(self, texture: Btf, atlas: ShaderTexture, name: str) -> Mapping[str, bytes]:
        head = [*preamble(texture), *texture_facts(texture, atlas, name)]
        language = self.texture_language or self.language
        source = texture_source(atlas, name, language, self.dialect, head)
        return {f"{name}{self.suffix}": source.encode(), **atlas.files(name)}


def texture_facts(texture: Btf, atlas: ShaderTexture, name: str) -> list[str]:
    """Lines about the functions of a texture, its arrays, and their errors."""
    lines = [line.replace("NAME", name) for line in _CONVENTIONS]
    lines.append("")
    for each, levels in atlas.textures().items():
        *layers, rows, columns, channels = levels[0].shape
        shape = " x ".join(map(str, [columns, rows, *layers]))
        kind = "texture array" if layers else "texture"
        text = "RGBA8" if levels[0].itemsize == 1 else "RGBA16F" if channels == 4 else "R16F"
        size = sum(pixels.nbytes for pixels in levels)
        mipmaps = f", {len(levels)} levels" if len(levels) > 1 else ""
        lines.append(f"{name}_{each}.ktx2: {kind}, {text}, {shape}{mipmaps}, {size} bytes")
    lines.append(
        "Each is the texture of its name: not sRGB, filtered linearly (levels too), repeated."
    )
    return [*lines, *error_lines(texture, atlas)]
