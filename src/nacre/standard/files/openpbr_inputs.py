"""Inputs of OpenPBR's node, as shared by MaterialX and USD files."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, TypeAlias

from nacre.errors import FormatError
from nacre.standard.files.facts import parsed_facts
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

_ABSENT: Mapping[str, float] = {
    "transmission_weight": 0.0,
    "subsurface_weight": 0.0,
    "emission_luminance": 0.0,
    "geometry_opacity": 1.0,
    "geometry_thin_walled": 0.0,
}
"""Inputs of effects that no reflectance has, with the value that they must have."""

_WITHOUT_EFFECT: Mapping[str, type] = {
    "transmission_color": tuple,
    "transmission_depth": float,
    "transmission_scatter": tuple,
    "transmission_scatter_anisotropy": float,
    "transmission_dispersion_scale": float,
    "transmission_dispersion_abbe_number": float,
    "subsurface_color": tuple,
    "subsurface_radius": float,
    "subsurface_radius_scale": tuple,
    "subsurface_scatter_anisotropy": float,
    "emission_color": tuple,
}
"""Inputs that matter only with one of those."""

KINDS: Mapping[str, type] = {
    **{name: type(value) for name, value in DEFAULTS.items()},
    **dict.fromkeys(_ABSENT, float),
    **_WITHOUT_EFFECT,
}
"""Whether each input is a number (or a truth value) or a color."""

_ANISOTROPY = "specular_roughness_anisotropy", "coat_roughness_anisotropy"


def read(inputs: Mapping[str, Input], angle: float | None, facts: str | None) -> OpenPbr:
    """The material that inputs describe.

    Parameters
    ----------
    inputs
        The inputs from :data:`KINDS` that a file has.
    angle
        Of the tangent, in radians; None if a file does not turn it.
    facts
        The text from :func:`facts_of`; None in other tools' files.

    Raises
    ------
    FormatError
        If a value is out of bounds, the material transmits or emits light or is cut out, or the
        facts are damaged.
    """
    name, metadata = parsed_facts(facts)
    for each, expected in _ABSENT.items():
        if inputs.get(each, expected) != expected:
            raise FormatError(
                f"{each} is {inputs[each]:g}: only what the surface reflects is read; "
                f"set it to {expected:g}"
            )
    values: dict[str, Any] = {name: inputs.get(name, value) for name, value in DEFAULTS.items()}
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


def _half_turn(angle: float) -> float:
    """An equivalent angle from -90 to 90 degrees: a tangent and its opposite are the same here."""
    if ANGLE.low <= angle <= ANGLE.high:
        return angle
    return math.remainder(angle, math.pi)
