"""Inputs of OpenPBR's node, as shared by MaterialX and USD files."""

from __future__ import annotations

import math
from collections import ChainMap
from collections.abc import Mapping
from typing import Any, TypeAlias

from nacre.errors import FormatError
from nacre.standard.files.facts import parsed_facts
from nacre.standard.files.opaque_part import OpaquePart
from nacre.standard.openpbr import ANGLE, AnisotropicOpenPbr, OpenPbr

Color: TypeAlias = tuple[float, float, float]
Input: TypeAlias = float | Color

NODE = "open_pbr_surface"
NODE_DEFINITION = "ND_open_pbr_surface_surfaceshader"
TANGENTS = "geometry_tangent", "geometry_coat_tangent"

_WHITE = (1.0, 1.0, 1.0)
DEFAULTS: Mapping[str, Input] = {
    "base_weight": 1.0,
    "base_color": (0.8, 0.8, 0.8),
    "base_diffuse_roughness": 0.0,
    "base_metalness": 0.0,
    "specular_weight": 1.0,
    "specular_color": _WHITE,
    "specular_roughness": 0.3,
    "specular_roughness_anisotropy": 0.0,
    "specular_ior": 1.5,
    "coat_weight": 0.0,
    "coat_color": _WHITE,
    "coat_roughness": 0.0,
    "coat_roughness_anisotropy": 0.0,
    "coat_ior": 1.6,
    "coat_darkening": 1.0,
    "fuzz_weight": 0.0,
    "fuzz_color": _WHITE,
    "fuzz_roughness": 0.5,
    "thin_film_weight": 0.0,
    "thin_film_thickness": 0.5,
    "thin_film_ior": 1.4,
}
"""Defaults (OpenPBR 1.1, "Parameter reference")."""

OTHERS: Mapping[str, Input] = {
    "transmission_weight": 0.0,
    "subsurface_weight": 0.0,
    "subsurface_color": (0.8, 0.8, 0.8),
    "subsurface_scatter_anisotropy": 0.0,
    "emission_luminance": 0.0,
    "geometry_opacity": 1.0,
    "geometry_thin_walled": 0.0,
}
"""The same for effects that no reflectance has."""

WITHOUT_EFFECT: Mapping[str, type] = {
    "transmission_color": tuple,
    "transmission_depth": float,
    "transmission_scatter": tuple,
    "transmission_scatter_anisotropy": float,
    "transmission_dispersion_scale": float,
    "transmission_dispersion_abbe_number": float,
    "subsurface_radius": float,
    "subsurface_radius_scale": tuple,
    "emission_color": tuple,
}
"""Inputs that change nothing about what an opaque surface reflects."""

KINDS: Mapping[str, type] = {
    **{name: type(value) for name, value in (*DEFAULTS.items(), *OTHERS.items())},
    **WITHOUT_EFFECT,
}
"""Whether each input is a number (or a truth value) or a color."""

_ANISOTROPY = "specular_roughness_anisotropy", "coat_roughness_anisotropy"
_SWITCHES = {
    "specular_ior": "specular_weight",
    "coat_ior": "coat_weight",
    "thin_film_ior": "thin_film_weight",
    "thin_film_thickness": "thin_film_weight",
}
"""Weights that, where they are 0, leave an input without effect."""


def read(
    inputs: Mapping[str, Any],
    angle: float | None,
    facts: str | None,
    opaque: OpaquePart,
    called: Mapping[str, str] | None = None,
) -> OpenPbr:
    """The material that inputs describe.

    Parameters
    ----------
    inputs
        The inputs from :data:`KINDS` that a file has.
    angle
        Of the tangent, in radians; None if a file does not turn it.
    facts
        The text from :func:`facts_of`; None in other tools' files.
    opaque
        What becomes of transmission, subsurface scattering, emission and cutouts.
    called
        What a file calls inputs, where that is not OpenPBR's name.

    Raises
    ------
    FormatError
        If a value is out of bounds, the material transmits or emits light or is cut out and that is
        refused, or the facts are damaged.
    """
    name, metadata, notes = parsed_facts(facts)
    opaque.notes[:0] = notes
    given = ChainMap(inputs, {**DEFAULTS, **OTHERS})  # type: ignore[arg-type]  # it is only read
    values: dict[str, Any] = {each: given[each] for each in DEFAULTS}
    values |= _base(given, opaque, called or {})
    for each, weight in _SWITCHES.items():
        if values[weight] == 0.0 and not values[each] >= 1.0:
            values[each] = DEFAULTS[each]
    model: type[OpenPbr] = AnisotropicOpenPbr
    if angle is None and not any(values[name] for name in _ANISOTROPY):
        model = OpenPbr
        values = {k: v for k, v in values.items() if k not in _ANISOTROPY}
    else:
        values["angle"] = _half_turn(angle or 0.0)
    try:
        return model(name=name, metadata=metadata, **values)
    except ValueError as error:
        raise FormatError(str(error)) from error


def _base(
    given: Mapping[str, Any], opaque: OpaquePart, called: Mapping[str, str]
) -> dict[str, Input]:
    """Weight and color of the base where it is not all opaque and diffuse; else nothing.

    What transmits leaves that much less of the diffuse base. What scatters inside comes back as if
    it had not traveled: a diffuse base of its color, half of it or so where walls are thin.
    """

    def name(each: str) -> str:
        return called.get(each, each)

    if luminance := given["emission_luminance"]:
        emission = name("emission_luminance")
        problem = f"{emission} is {luminance:g}: emission is not read"
        opaque.without(problem, "set it to 0", f"Emission is left out ({emission} {luminance:g}).")
    if (opacity := given["geometry_opacity"]) != 1.0:
        cutout = name("geometry_opacity")
        problem = f"{cutout} is {opacity:g}: opacity other than 1 is not read"
        opaque.without(problem, "set it to 1", f"Opacity is taken as 1 ({cutout} is {opacity:g}).")
    metal = given["base_metalness"]
    weights = given["subsurface_weight"], given["transmission_weight"]
    if metal == 1.0 or weights == (0.0, 0.0):  # below metal there is nothing
        return {}
    scattered, through = (name(f"{each}_weight") for each in ("subsurface", "transmission"))
    how = "read as diffuse reflection of its color"
    diffuse = opaque.share(scattered, weights[0], "subsurface scattering", how)
    kept = opaque.share(through, weights[1], "transmission", "left out")
    weight, color = given["base_weight"], given["base_color"]
    if diffuse < 1.0:
        inner = given["subsurface_color"]
        if given["geometry_thin_walled"]:
            back = 0.5 - 0.5 * given["subsurface_scatter_anisotropy"]
            inner = [back * c for c in inner]
        mixed = [diffuse * weight * c + weights[0] * i for c, i in zip(color, inner, strict=True)]
        weight, color = 1.0, (mixed[0], mixed[1], mixed[2])
    weight *= kept
    if metal and (weight, color) != (given["base_weight"], given["base_color"]):
        mixture = f"{name('base_metalness')} is {metal:g}"
        raise FormatError(f"{mixture}: no part of a metal transmits; set it to 0 or 1")
    return {"base_weight": weight, "base_color": color}


def _half_turn(angle: float) -> float:
    """An equivalent angle from -90 to 90 degrees: a tangent and its opposite are the same here."""
    if ANGLE.low <= angle <= ANGLE.high:
        return angle
    return math.remainder(angle, math.pi)
