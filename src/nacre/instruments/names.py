"""Names of instruments and geometries, as people and instruments write them."""

from __future__ import annotations

import re
from dataclasses import replace

from nacre.errors import did_you_mean
from nacre.instruments.goniocolorimeter import Geometry
from nacre.instruments.illuminants import ILLUMINANTS, OBSERVERS, Illuminant, Observer
from nacre.instruments.quantities import (
    ColorQuantity,
    FortyFiveQuantity,
    GlossQuantity,
    HazeQuantity,
    MultiangleQuantity,
    Quantity,
    ReflectanceQuantity,
    SphereQuantity,
)

_NUMBER = r"-?\d+(?:\.\d+)?"
_ASPECULAR = re.compile(rf"r?(\d+)as(minus|_|-)?(\d+(?:\.\d+)?)(?:az({_NUMBER}))?")
_INCLUDED = "di:8", "sci", "d/8i", "d8i", "8:di", "spin", "rsin", "included", "8i"
_EXCLUDED = "de:8", "sce", "d/8e", "d8e", "8:de", "spex", "rsex", "excluded", "8e"
_ANNULAR = "45a:0", "45:0", "45/0", "45-0", "0:45", "0/45", "0:45a", "45c:0", "45/0c"
_DIRECTIONAL = "45x:0", "0:45x"
_KINDS = "gloss", "haze", "multiangle", "sphere", "45-0", "f_r"
_WORDS = {
    "gloss": ("gloss", "glanz"),
    "haze": ("haze",),
    "multiangle": ("multiangle", "multi-angle", "byk-mac", "bykmac", "ma-t", "ma9", "ma6"),
    "sphere": ("sphere", "d:8", "d/8", "d8", "cm-", "sci", "sce", "reflectance"),
    "45-0": ("45-0", "45/0", "45:0", "45a:0", "45x:0", "0/45", "0:45"),
    "f_r": ("f_r", "brdf", "bsdf", "goniometer", "gonioreflectometer"),
}
"""What the name of an instrument says of what it reads."""


def find_quantity(
    instrument: str, geometry: str = "", illuminant: str = "", observer: str = ""
) -> Quantity:
    """What an instrument reads at a geometry.

    Spellings are those of the field: "BYK micro-TRI-gloss" at "60°", "MA-T12" at "r45as-15",
    "sphere" at "SCI". Illuminant and observer, as "D65" and "10" or together as "D65/10°", are
    those of colors. Raises ValueError, in one line, if nothing or nothing known is meant.
    """
    kind = _kind(instrument, geometry)
    place = _plain(geometry)
    if kind == "gloss":
        return _gloss(place or _plain(instrument))
    if kind == "haze":
        return _haze(f"{instrument} {geometry}".lower())
    if kind == "f_r":
        return _pair(geometry)
    color = _color(kind, place or _plain(instrument))
    light, field = _conditions(illuminant, observer)
    return replace(color, illuminant=light, observer=field)


def _plain(text: str) -> str:
    return re.sub(r"[\s°]|deg(rees?)?", "", text.lower())


def _kind(instrument: str, geometry: str) -> str:
    """The one of :data:`_KINDS` that an instrument is."""
    text = _plain(instrument)
    if not text:
        raise ValueError(f"is empty; write one of {', '.join(_KINDS)}")
    if "haze" in text:
        return "haze" if "gloss" not in text or "haze" in _plain(geometry) else "gloss"
    for kind, words in _WORDS.items():
        if any(word in text for word in words):
            return kind
    if _ASPECULAR.fullmatch(_plain(geometry)):
        return "multiangle"
    close = did_you_mean(text, _KINDS)
    raise ValueError(f"{instrument[:40]!r} is not one of {', '.join(_KINDS)}{close}")


def _gloss(text: str) -> GlossQuantity:
    angles = [float(number) for number in re.findall(r"\d+", text)]
    if len(angles) != 1 or angles[0] not in (20.0, 60.0, 85.0):
        raise ValueError(f"{text[:40]!r} is no angle of gloss; write 20, 60 or 85")
    return GlossQuantity(angles[0])


def _haze(text: str) -> HazeQuantity:
    if "log" in text:
        return HazeQuantity("log")
    return HazeQuantity("compensated" if "comp" in text else "linear")


def _pair(text: str) -> ReflectanceQuantity:
    numbers = [float(number) for number in re.findall(_NUMBER, text)]
    if len(numbers) != 4:
        raise ValueError(
            f"{text[:40]!r} is no pair of directions; write theta_i phi_i theta_o phi_o in "
            "degrees, like 45 0 30 180"
        )
    return ReflectanceQuantity(*numbers)


def _color(kind: str, text: str) -> ColorQuantity:
    if kind == "multiangle":
        return MultiangleQuantity(_geometry(text))
    if kind == "45-0":
        if text in _DIRECTIONAL:
            return FortyFiveQuantity("45x:0")
        if text in _ANNULAR or "45" not in text:
            return FortyFiveQuantity("45a:0")
        raise ValueError(f"{text[:40]!r} is not 45a:0 or 45x:0")
    if (beam := re.fullmatch(r"(\d+(?:\.\d+)?):di", text)) and text not in _INCLUDED:
        if float(beam[1]) >= 90.0:
            raise ValueError(f"{text[:40]!r}: the angle of light must be below 90 degrees")
        return SphereQuantity(f"{float(beam[1]):g}:di")
    for name, words in (("de:8", _EXCLUDED), ("di:8", _INCLUDED)):
        if any(word in text for word in words):
            return SphereQuantity(name)
    raise ValueError(f"{text[:40]!r} is not di:8 (SCI), de:8 (SCE) or N:di")


def _geometry(text: str) -> Geometry:
    found = _ASPECULAR.fullmatch(text)
    if found:
        sign = -1.0 if found[2] else 1.0
        around = None if found[4] is None else float(found[4])
        at = Geometry(float(found[1]), sign * float(found[3]), around)
    elif re.fullmatch(_NUMBER, text):
        at = Geometry(45.0, float(text))
    else:
        raise ValueError(f"{text[:40]!r} is no aspecular angle; write one like 45as15")
    if at.light >= 90.0 or not at.directions()[1][2] > 0.0:
        raise ValueError(f"{text[:40]!r} is below the surface")
    return at


def _conditions(illuminant: str, observer: str) -> tuple[Illuminant, Observer]:
    """Illuminant and observer; the first may hold both."""
    light, _, field = illuminant.upper().replace(" ", "").partition("/")
    light = {"FL11": "F11", "TL84": "F11"}.get(light, light) or "D65"
    field = _plain(observer or field).replace("1931", "2").replace("1964", "10") or "2"
    for known in ILLUMINANTS:
        for size in OBSERVERS:
            if (light, field) == (known, str(size)):
                return known, size
    raise ValueError(
        f"{light[:20]!r} with {field[:20]!r} degrees: illuminants are {', '.join(ILLUMINANTS)}, "
        "observers 2 and 10 degrees"
    )
