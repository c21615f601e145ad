"""Facts about a file of any kind, with their units."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre.brdf import COLOR, Brdf
from nacre.btf import Btf
from nacre.errors import FormatError, reason
from nacre.formats import identify, load_brdf, load_btf
from nacre.included import resolve
from nacre.io.files import PathLike, check_json, read_bytes
from nacre.io.tensors import has_header
from nacre.latent.estimates import ENOUGH, plausible
from nacre.latent.estimates import facts as plausible_facts
from nacre.latent.intervals import interval
from nacre.workflows import sentences
from nacre.workflows.sentences import Sentences

if TYPE_CHECKING:
    from nacre.io.format import Format
    from nacre.measured.textures.image_folder import Quantity

_CODE_LIMIT = 1 << 20
_UNITS = {
    "value range": "1/sr",
    "table range": "as stored",
    "invalid samples": "fraction of nodes",
    "points with a negative channel": "fraction of tabulated points",
    "points below the horizon": "fraction of tabulated points",
    "memory bytes": "bytes",
    "wavelengths nm": "nm",
    "bytes": "bytes",
    "training loss": "mean log-cosine loss",
    "held out loss": "mean log-cosine loss",
    "environment psnr": "dB, spheres in an environment, against the fitted material",
    "directional psnr": "dB, spheres in directional light, against the fitted material",
    "rounding psnr": "dB, spheres, against the network in single precision",
    "angle of the axes": "degrees",
    "plausible albedo from": "red, green, blue, for light along the normal; 5 % are below",
    "plausible albedo to": "red, green, blue, for light along the normal; 5 % are above",
    "f_r known within a factor": "median over pairs of directions, 90 %",
    "plausible gloss at 60 degrees from": "GU; 5 % are below",
    "plausible gloss at 60 degrees to": "GU; 5 % are above",
    "plausible color at 45:0 from": "L*, a*, b* under D65; 5 % are below",
    "plausible color at 45:0 to": "L*, a*, b* under D65; 5 % are above",
}
"""Units of the facts about a reflectance."""
_TEXTURE_UNITS = {
    "largest polar angle of lights": "degrees",
    "largest polar angle of views": "degrees",
    "value range": "reflectance factor",
    "mean value": "reflectance factor",
    "bytes as half floats": "bytes",
    "bytes": "bytes",
}
"""Units of the facts about a texture; values come from a sample of it."""


@dataclass(frozen=True)
class Inspection:
    """What a file holds."""

    kind: str  # "brdf", "btf", "codec", "basis", "code" or "map"
    facts: Mapping[str, Any]  # in the order to show them
    units: Mapping[str, str]  # of the facts that have one
    brdf: Brdf | None = None
    sentences: Sentences = ("", "", "")
    looks_wrong: bool = False  # what the last of the sentences says


def inspect(path: PathLike, *, physics: bool = True, pixels: Quantity | None = None) -> Inspection:
    """Facts about a material, or another file that nacre writes.

    Parameters
    ----------
    physics
        Compute energy, reciprocity and anisotropy of a reflectance.
    pixels
        Meaning of the pixels in a folder of images; see :func:`nacre.load`.

    Raises
    ------
    FormatError
        If the file cannot be read or is of no known kind, or if `pixels` is given for something
        other than a folder of images.
    """
    path = resolve(path)
    other = _other(path)
    if other is not None:
        if pixels is not None:
            raise FormatError(f"{path}: has no images; leave out --pixels")
        return other
    entry = identify(path)
    if entry.kind == "brdf":
        return _reflectance(path, entry, load_brdf(path), physics)
    if pixels is not None and entry.claims_folder is None:
        raise FormatError(f"{path}: defines its values itself; --pixels is for folders of images")
    texture = load_btf(path, quantity=pixels)
    if texture.texel_count == 1 and entry.load_material is not None:
        return _reflectance(path, entry, load_brdf(path), physics)
    facts = {**inspect_material(texture).facts, "format": entry.name}
    if path.is_file():
        facts["bytes"] = path.stat().st_size
    facts |= _terms(texture.source)
    said, wrong = sentences.texture(facts, entry, path.name)
    return Inspection("btf", facts, _known(facts, _TEXTURE_UNITS), None, said, wrong)


def inspect_material(material: Brdf | Btf, *, physics: bool = True) -> Inspection:
    """Facts about a material in memory, without those of its file; see :func:`inspect`."""
    if isinstance(material, Btf):
        from nacre.textures.selection import some_values

        values = some_values(material)
        facts = material.describe() | {
            "value range": [float(values.min()), float(values.max())],
            "mean value": [float(x) for x in values.mean(axis=0, dtype=float)],
        }
        said, wrong = sentences.texture(facts)
        return Inspection("btf", facts, _known(facts, _TEXTURE_UNITS), None, said, wrong)
    facts, units = dict(material.describe()) | plausible_facts(material), dict(_UNITS)
    if physics:
        from nacre.metrics.facts import UNITS, physical_facts

        facts |= physical_facts(material) | _read(material)
        units |= UNITS
    said, wrong = sentences.reflectance(facts, material)
    return Inspection("brdf", facts, _known(facts, units), material, said, wrong)


def _read(material: Brdf) -> dict[str, Any]:
    """What instruments would read of a material known with some uncertainty: 90 % intervals."""
    others = plausible(material)[:ENOUGH]
    if not others or material.channels != COLOR:
        return {}
    from nacre.instruments.quantities import FortyFiveQuantity, GlossQuantity

    found: dict[str, Any] = {}
    for what, quantity in (
        ("gloss at 60 degrees", GlossQuantity(60.0)),
        ("color at 45:0", FortyFiveQuantity(at="45a:0")),
    ):
        low, high = interval([quantity.read(each) for each in others])
        found[f"plausible {what} from"] = low.tolist()
        found[f"plausible {what} to"] = high.tolist()
    return found


def _reflectance(path: Path, entry: Format, brdf: Brdf, physics: bool) -> Inspection:
    found = inspect_material(brdf, physics=physics)
    facts = {
        **found.facts,
        "bytes": path.stat().st_size,
        "sha256": (brdf.source or {}).get("sha256", ""),
        **_terms(brdf.source),
    }
    said, wrong = sentences.reflectance(facts, brdf, entry, path.name)
    units = {**found.units, **_known(facts, _UNITS)}
    return Inspection("brdf", facts, units, brdf, said, wrong)


def _terms(source: Mapping[str, str] | None) -> dict[str, str]:
    """The terms of use beside a file, if any."""
    terms = (source or {}).get("terms")
    return {"terms": terms} if terms else {}


def _other(path: Path) -> Inspection | None:
    """Facts about a file of nacre that is not a material; None for other files."""
    from nacre.latent.file import KEY as BASIS
    from nacre.latent.file import is_code, load_basis
    from nacre.textures.codecs.codec_file import KEY as CODEC
    from nacre.textures.codecs.codec_file import codec_facts
    from nacre.textures.embedding import KEY as MAP
    from nacre.textures.embedding import load_embedding_map

    facts: dict[str, Any]
    if has_header(path, CODEC):
        facts = codec_facts(path)
        said = sentences.other("codec", facts, path.name)
        return Inspection("codec", facts, {"bytes": "bytes"}, None, said)
    if has_header(path, BASIS):
        kind, described = "basis", load_basis(path).describe()
        facts = {"model" if name == "kind" else name: value for name, value in described.items()}
    elif has_header(path, MAP):
        kind, chart = "map", load_embedding_map(path)
        facts = {"texels": len(chart.texture), "textures": ", ".join(chart.names)}
    elif is_code(path):
        kind, facts = "code", _code_facts(path)
    else:
        return None
    facts["bytes"] = path.stat().st_size
    said = sentences.other(kind, facts, path.name)
    return Inspection(kind, facts, _known(facts, _UNITS), None, said)


def _code_facts(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(read_bytes(path, _CODE_LIMIT))
        check_json(content)
        return {
            "name": content["name"],
            "model": content["code of"],
            "code dim": len(content["values"]),
            "basis sha256": content["basis"],
        }
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise FormatError(f"{path}: is not a whole code: {reason(error)}") from error


def _known(facts: Mapping[str, Any], units: Mapping[str, str]) -> dict[str, str]:
    return {name: unit for name, unit in units.items() if name in facts and unit}
