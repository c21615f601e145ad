"""What the generators of surfaces share: parameters that are plain data, checked."""

from __future__ import annotations

import abc
import dataclasses
import re
from collections.abc import Mapping
from typing import Any, ClassVar, Self

import numpy as np

from nacre.array import Floats
from nacre.textures.capture.mesostructure import SMOOTHEST, Mesostructure

_OLD_NAMES = {"vein_colour": "vein_color"}
"""Names of parameters in recipes that were written before, and what they are now."""
_COLOR = re.compile(r"#[0-9a-fA-F]{6}")


def number(default: float, low: float, high: float) -> Any:
    return dataclasses.field(default=default, metadata={"low": low, "high": high})


def whole(default: int, low: int, high: int) -> Any:
    return dataclasses.field(default=default, metadata={"low": low, "high": high, "whole": True})


def choice(*options: str) -> Any:
    """A parameter that is one of some words, the first by default."""
    return dataclasses.field(default=options[0], metadata={"options": options})


def colors(*default: str, max_count: int = 16) -> Any:
    """A parameter of sRGB colors, up to `max_count`, like "#a0522d"."""
    return dataclasses.field(default=default, metadata={"colors": max_count})


@dataclasses.dataclass(frozen=True)
class Generator(abc.ABC):
    """A kind of surface; its fields are the parameters.

    Roughness is GGX alpha; `specular` is the Fresnel reflectance at normal incidence.
    """

    name: ClassVar[str]  # in recipes: that of the class, in lower case

    def __init_subclass__(cls) -> None:
        cls.name = cls.__name__.lower()

    @abc.abstractmethod
    def build(self, random: np.random.Generator, size: int) -> Mesostructure:
        """One period on a grid of `size` x `size` cells."""

    @classmethod
    def from_json(cls, values: Mapping[str, Any]) -> Self:
        """The surface with some parameters given and the others left at their defaults.

        A ValueError names the parameter that is unknown or has an impossible value.
        """
        values = current_names(values)
        known = {field.name: field for field in dataclasses.fields(cls)}
        for key in values:
            if key not in known:
                raise ValueError(f"{key}: is not a parameter of {cls.name} ({', '.join(known)})")
        checked = {k: _checked(k, v, known[k].metadata) for k, v in values.items()}
        return cls(**checked)


def current_names(values: Mapping[str, Any]) -> dict[str, Any]:
    """Parameters from JSON by the names that they have now."""
    return {_OLD_NAMES.get(name, name): value for name, value in values.items()}


def _checked(key: str, value: Any, rule: Mapping[str, Any]) -> Any:
    if "options" in rule:
        if value not in rule["options"]:
            raise ValueError(f"{key}: expected one of {', '.join(rule['options'])}, got {value!r}")
        return value
    if "colors" in rule:
        limit = rule["colors"]
        if not isinstance(value, list) or not 1 <= len(value) <= limit:
            count = f"1 to {limit} colors" if limit > 1 else "1 color"
            raise ValueError(f"{key}: expected a list of {count}")
        for color in value:
            if not isinstance(color, str) or not _COLOR.fullmatch(color):
                raise ValueError(f'{key}: expected colors like "#a0522d", got {color!r}')
        return tuple(value)
    kind = "a whole number" if rule.get("whole") else "a number"
    low, high = rule["low"], rule["high"]
    allowed = int if rule.get("whole") else int | float
    if isinstance(value, bool) or not isinstance(value, allowed) or not low <= value <= high:
        raise ValueError(f"{key}: expected {kind} from {low} to {high}, got {value!r}")
    return value


def cover(
    height: Floats,
    albedo: Floats,
    specular: Floats | float,
    along: Floats | float,
    across: Floats | float | None = None,
    direction: Floats | float = 0.0,
    tint: Floats | float = 0.0,
) -> Mesostructure:
    """A surface about z = 0, with a specular color between gray and the hue of the albedo.

    Height is in periods, and its mean is taken off; albedo is linear RGB, clipped to [0, 0.95];
    `specular` is the Fresnel reflectance at normal incidence, and `tint` how much of the albedo's
    hue it has, 0 to 1. `along` and `across` are roughness in and perpendicular to the direction,
    the same where `across` is None; the direction is an azimuth in radians.
    """
    shape = height.shape
    albedo = np.clip(albedo, 0.0, 0.95)
    hue = albedo / np.maximum(albedo.max(-1, keepdims=True), 1e-6)
    gray, hue_fraction = (np.broadcast_to(v, shape)[..., None] for v in (specular, tint))
    across = along if across is None else across
    color = np.clip(gray * (1.0 - hue_fraction + hue_fraction * hue), 0.0, 1.0)
    rough = np.stack([np.broadcast_to(v, shape) for v in (along, across)], -1)
    rough, azimuth = np.clip(rough, SMOOTHEST, 1.0), np.array(np.broadcast_to(direction, shape))
    return Mesostructure(height - height.mean(), albedo, color, rough, azimuth)
