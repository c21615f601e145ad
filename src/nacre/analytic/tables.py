"""Published tables of fitted parameters: `.fit` files of the BSDF benchmark BBM.

Each line is `material = Aggregate(Lambertian(albedo = [...]), Model(parameter = number, ...))`. The
headers of the models of each paper there tell what the parameters mean
(https://github.com/bsdfbenchmark/bbm).
"""

from __future__ import annotations

import ast
import math
import re
from pathlib import Path
from typing import Any

from nacre.analytic.catalog import MODELS
from nacre.analytic.model import AnalyticBrdf
from nacre.errors import FormatError
from nacre.io.files import read_bytes
from nacre.io.format import Format
from nacre.io.names import chosen

_LIMIT = 1 << 22
_LONGEST = 1 << 14
_LINE = re.compile(r"^([\w.()+-]+) *= *(.+)$")

_FRESNEL = "fresnelReflectance"
_LOBE = {"albedo": "specular"}
_ROUGH = _LOBE | {"roughness": "roughness"}
_SHARP = _LOBE | {"sharpness": "exponent"}
_ABC = {"A": "specular", "B": "b", "C": "c", "eta": "index"}
_SGD = {"alpha": "alpha", "p": "p", "K": "normalisation", "Lambda": "lambda", "k": "k"}

_MODELS: dict[str, tuple[str, dict[str, str]]] = {
    "NganBlinnPhong": ("blinn-phong", _SHARP),
    "NganWard": ("ward", _ROUGH),
    "NganWardDuer": ("ward-duer", _ROUGH),
    "NganLafortune": ("lafortune", _SHARP | {"Cxy": "c_xy", "Cz": "c_z"}),
    "NganAshikhminShirley": ("ashikhmin-shirley", _SHARP | {_FRESNEL: "normal_reflectance"}),
    "NganCookTorrance": ("cook-torrance-schlick", _ROUGH | {"eta": "normal_reflectance"}),
    "LowAshikhminShirley": ("ashikhmin-shirley-dielectric", _SHARP | {_FRESNEL: "index"}),
    "LowCookTorrance": ("cook-torrance", _ROUGH | {"eta": "index"}),
    "LowMicrofacetFit": ("abc-microfacet", _ABC),
    "LowSmooth": ("abc-smooth", _ABC),
    "Bagher": ("sgd", _LOBE | _SGD | {"theta0": "theta_0"}),
}
"""Name of the model here, and of its parameters, by the name in the tables."""

_SCALES = 1.0, 1.15, 1.66
"""Scales of red, green and blue in MERL's own reader, relative to red.

Ngan et al. 2005 fitted values as the files store them: their colors lack these factors, which those
of Low et al. 2012 and Bagher et al. 2012 have, and the paper does not say so."""


def materials(path: Path) -> dict[str, str]:
    """The formula of every material in a table, by name.

    Raises FormatError if the file is not text, a line is no material, or there is none.
    """
    try:
        text = read_bytes(path, _LIMIT).decode("utf-8")
    except UnicodeDecodeError as error:
        raise FormatError(f"{path}: is not text in UTF-8") from error
    found: dict[str, str] = {}
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        match = _LINE.match(line) if len(line) <= _LONGEST else None
        if match is None:
            raise FormatError(f"{path}: line {number} is not 'material = Aggregate(...)'")
        found[match[1]] = match[2]
    if not found:
        raise FormatError(f"{path}: holds no material")
    return found


def load(path: Path, material: str | None = None) -> AnalyticBrdf:
    """Read one material of a table.

    Raises FormatError if there is no such material, or its model is unknown.
    """
    known = materials(path)
    material = list(known)[chosen(path, list(known), material)]
    where = f"{path}: {material[:80]}"
    diffuse, kind, given = _parse(known[material], where)
    if kind.startswith("Ngan"):
        diffuse = _scaled(diffuse)
        given = {key: _scaled(value) if key == "albedo" else value for key, value in given.items()}
    if kind not in _MODELS:
        raise FormatError(f"{where}: model {kind[:40]!r} is not one of {', '.join(_MODELS)}")
    model, names_here = _MODELS[kind]
    if kind == "Bagher":
        try:
            given["normal_reflectance"], given["slope"] = given.pop("eta")
            given["log_c"] = [math.log(c) for c in given.pop("c")]
        except (KeyError, TypeError, ValueError) as error:
            raise FormatError(f"{where}: eta or c is not what this model takes") from error
    values = {names_here.get(key, key): value for key, value in given.items()}
    try:
        return MODELS[model](name=material, diffuse=diffuse, **values)
    except (ValueError, TypeError, OverflowError) as error:
        raise FormatError(f"{where}: {error}") from error


def _scaled(color: Any) -> Any:
    """Stored red, green and blue as MERL's reader scales them; anything else as it is."""
    match color:
        case [int() | float(), int() | float(), int() | float()]:
            return [scale * value for scale, value in zip(_SCALES, color, strict=True)]
    return color


def _parse(formula: str, where: str) -> tuple[Any, str, dict[str, Any]]:
    """Diffuse albedo, name of the model, and its parameters; nothing is run."""
    try:
        match ast.parse(formula, mode="eval").body:
            case ast.Call(
                func=ast.Name(id="Aggregate"),
                args=[
                    ast.Call(
                        func=ast.Name(id="Lambertian"),
                        args=[],
                        keywords=[ast.keyword(arg="albedo", value=albedo)],
                    ),
                    ast.Call(func=ast.Name(id=kind), args=[], keywords=keywords),
                ],
                keywords=[],
            ) if all(keyword.arg for keyword in keywords):
                given = {str(k.arg): ast.literal_eval(k.value) for k in keywords}
                return ast.literal_eval(albedo), kind, given
    except (SyntaxError, ValueError, TypeError, MemoryError, RecursionError) as error:
        raise FormatError(f"{where}: is not a list of parameters") from error
    raise FormatError(f"{where}: is not Aggregate(Lambertian(albedo = ...), Model(...))")


FORMAT = Format(
    "table of fits",
    (".fit",),
    lambda head: b"BSDF fits" in head or b"Aggregate(" in head,
    load,
    materials=lambda path: list(materials(path)),
    measured=False,
)
