"""Converts materials between glTF's JSON and :class:`nacre.standard.gltf.Gltf`.

glTF 2.0, sections 3.9 and 5.19, and the texts of the extensions that the model has.
"""

from __future__ import annotations

import math
import reprlib
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from nacre.errors import FormatError
from nacre.standard.gltf import AnisotropicGltf, Gltf

_WHITE, _BLACK = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)

_CORE: Mapping[str, Any] = {
    "baseColorFactor": _WHITE,
    "metallicFactor": 1.0,
    "roughnessFactor": 1.0,
}
_EXTENSIONS: Mapping[str, Mapping[str, Any]] = {
    "KHR_materials_ior": {"ior": 1.5},
    "KHR_materials_specular": {"specularFactor": 1.0, "specularColorFactor": _WHITE},
    "KHR_materials_iridescence": {
        "iridescenceFactor": 0.0,
        "iridescenceIor": 1.3,
        "iridescenceThicknessMaximum": 400.0,
    },
    "KHR_materials_anisotropy": {"anisotropyStrength": 0.0, "anisotropyRotation": 0.0},
    "KHR_materials_sheen": {"sheenColorFactor": _BLACK, "sheenRoughnessFactor": 0.0},
    "KHR_materials_clearcoat": {"clearcoatFactor": 0.0, "clearcoatRoughnessFactor": 0.0},
}
"""Parameters and their defaults."""

_SWITCHES = {
    "KHR_materials_iridescence": "iridescenceFactor",
    "KHR_materials_anisotropy": "anisotropyStrength",
    "KHR_materials_sheen": "sheenColorFactor",
    "KHR_materials_clearcoat": "clearcoatFactor",
}
"""Parameters that switch a layer off if they are 0."""

_NEGLIGIBLE = 1e-5  # weight of a layer that is invisible; fits leave unneeded layers there

_WITHOUT_EFFECT = ("name", "extras", "doubleSided", "alphaCutoff", "iridescenceThicknessMinimum")
_FIX = "bake it to one value, or remove it"


def to_json(brdf: Gltf) -> dict[str, Any]:
    """The material without its name. Layers without effect are left out with all their numbers.

    Colors are clamped to the format's range.
    """
    values: dict[str, Any] = {}
    for parameter in brdf.parameters:
        value = brdf.values[parameter.name]
        low, high = parameter.low, parameter.high
        clamped = [min(max(v, low), high) for v in value] if isinstance(value, tuple) else value
        values[parameter.name] = clamped
    core = {name: values[name] for name in _CORE}
    core["baseColorFactor"] = [*core["baseColorFactor"], 1.0]
    extensions = {}
    for extension, defaults in _EXTENSIONS.items():
        given = {name: values.get(name, default) for name, default in defaults.items()}
        if extension in _SWITCHES:
            used = np.max(given[_SWITCHES[extension]]) > _NEGLIGIBLE
        else:
            used = any(not np.array_equal(given[name], defaults[name]) for name in defaults)
        if used:
            extensions[extension] = given
    return {"pbrMetallicRoughness": core, **({"extensions": extensions} if extensions else {})}


def from_json(material: Any, name: str, metadata: Mapping[str, Any]) -> Gltf:
    """The model for a material in JSON, from any tool.

    Raises FormatError that names what is damaged, or what the model lacks: a texture, transparency,
    emission, an extension.
    """
    material = _object(material, "the material")
    extensions = _object(material.get("extensions", {}), "extensions")
    core = _object(material.get("pbrMetallicRoughness", {}), "pbrMetallicRoughness")
    known = ("pbrMetallicRoughness", "extensions", "emissiveFactor", "alphaMode", *_WITHOUT_EFFECT)
    _check_known(material, known)
    if material.get("alphaMode", "OPAQUE") != "OPAQUE":
        raise FormatError(f"alphaMode: {_text(material['alphaMode'])}: only OPAQUE is read")
    if _numbers(material.get("emissiveFactor", [0, 0, 0]), "emissiveFactor", 3) != _BLACK:
        raise FormatError("emissiveFactor: emits light, which no reflectance does; set it to 0")
    for extension in extensions:
        if extension not in _EXTENSIONS:
            known_names = ", ".join(_EXTENSIONS)
            raise FormatError(f"{_text(extension)}: is not in the model, which has {known_names}")
    values = _read(core, _CORE)
    for extension, defaults in _EXTENSIONS.items():
        values |= _read(_object(extensions.get(extension, {}), extension), defaults)
    if values["ior"] == 0.0:
        raise FormatError("ior: 0 is a mode for old materials; set ior to at least 1")
    rotation, strength = values["anisotropyRotation"], values["anisotropyStrength"]
    values["anisotropyRotation"] = rotation - math.pi * round(rotation / math.pi)
    model = AnisotropicGltf if strength > _NEGLIGIBLE else Gltf
    try:
        for each in model.parameters:
            replace(each, allowed=None).check(values[each.name])
        given = {parameter.name: values[parameter.name] for parameter in model.parameters}
        return model(name=name, metadata=metadata, **given)
    except (ValueError, OverflowError) as error:
        raise FormatError(str(error)) from error


def _read(given: Mapping[str, Any], defaults: Mapping[str, Any]) -> dict[str, Any]:
    """Values of an object in the file, with defaults."""
    _check_known(given, (*defaults, *_WITHOUT_EFFECT))
    values: dict[str, Any] = {}
    for name, default in defaults.items():
        value = given.get(name, default)
        if not isinstance(default, tuple):
            values[name] = _numbers([value], name, 1)[0]
        else:
            count = 4 if name == "baseColorFactor" and name in given else 3
            values[name] = _numbers(value, name, count)[:3]
    return values


def _check_known(given: Mapping[str, Any], known: tuple[str, ...]) -> None:
    for name in given:
        if name.endswith("Texture"):
            raise FormatError(f"{_text(name)}: is a texture, this model has numbers only: {_FIX}")
        if name not in known:
            raise FormatError(f"{_text(name)}: is not in the model: {_FIX}")


def _object(given: Any, name: str) -> Mapping[str, Any]:
    if not isinstance(given, dict):
        raise FormatError(f"{name}: is not an object")
    return given


def _numbers(given: Any, name: str, count: int) -> tuple[float, ...]:
    """The expected count of finite numbers."""
    if not isinstance(given, list | tuple) or len(given) != count:
        raise FormatError(f"{name}: takes {count} numbers, got {_text(given)}")
    for number in given:
        if type(number) not in (int, float) or not abs(number) < 1e300:
            raise FormatError(f"{name}: takes numbers, got {_text(number)}")
    return tuple(map(float, given))


def _text(given: Any) -> str:
    """A value from the file, abbreviated."""
    return reprlib.repr(given)
