"""What columns of a table hold, from their names or from what a user says."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from nacre.errors import did_you_mean

ANGLES = "theta_i", "phi_i", "theta_o", "phi_o", "phi"
"""Light and viewer; phi is the azimuth between them."""
VALUES = "f", "r", "g", "b"
ROLES = (*ANGLES, *VALUES, "wavelength", "sigma")


def _words(*texts: str) -> frozenset[str]:
    return frozenset(word for text in texts for word in text.split())


_LIGHT = _words(
    "i in inc incident incidence incoming src source sun solar light lighting illum illumination",
    "aoi sza saa illuminator input",
)
_VIEW = _words(
    "o out outgoing r refl reflected reflection s scat scatter scattered scattering v view viewing",
    "viewer viewed det detector receiver rec rx measure measured measurement measuring sensor obs",
    "observation observer emission emergence exit e vza vaa output camera",
)
_ALONE = _words(
    "inc incident incidence incoming in light source aoi sza",
    "emission emergence exit outgoing out detector view viewing viewer vza",
)
"""Words that mean an angle from the normal where nothing else is said."""
_ZENITH = _words("theta zenith zen z polar angle th sza vza aoi incidence")
_AZIMUTH = _words("phi azimuth azimuthal azi az a saa vaa azim")
_RELATIVE = _words("raa rel relative dphi delta difference diff")
_WAVELENGTH = _words("wavelength wavelengths lambda wl wvl wave")
_SPREAD = _words("sigma std stdev stddev uncertainty unc error err u sd")
_VALUE = _words(
    "brdf bsdf brf f fr value values reflectance radiance factor hdrf bidirectional intensity"
)
_COLORS = {"red": "r", "green": "g", "blue": "b"}
_BAND = re.compile(r"(?<![\d.])(\d{2,6}(?:\.\d+)?)\s*(nm|nanometers?)(?![a-z])", re.I)
_MICRONS = re.compile(r"(?<![\d.])(\d{1,2}(?:\.\d+)?)\s*(um|µm|μm|microns?)(?![a-z])", re.I)
_NUMBER = re.compile(r"\s*(\d{3,5}(?:\.\d+)?)\s*")
_PREFIXED = re.compile(r"\s*[a-z_]{1,5}[_ ]?(\d{3,4}(?:\.\d+)?)\s*", re.I)
_UNIT = re.compile(r"[\[(]\s*(deg|degrees?|°|rad|radians?)\.?\s*[\])]|_(deg|rad)\b", re.I)


@dataclass(frozen=True)
class Columns:
    """Places of columns by what they hold."""

    places: Mapping[str, int]  # by ROLES
    bands: Mapping[float, int]  # by wavelength in nm
    radians: Mapping[str, bool]  # for angles whose names say it
    unused: Sequence[str]

    def text(self, names: Sequence[str]) -> str:
        """As a user would say it: theta_i=src_z,..., with bands as wavelengths."""
        pairs = [f"{role}={names[place]}" for role, place in self.places.items()]
        if len(self.bands) > 3:
            bands = sorted(self.bands)
            pairs.append(f"{len(bands)} bands from {bands[0]:g} to {bands[-1]:g} nm")
        else:
            pairs += [f"{band:g}={names[place]}" for band, place in self.bands.items()]
        return ", ".join(pairs)


def understood(names: Sequence[str], said: Mapping[str, str] | None) -> Columns:
    """Columns by their names, or as a user says: `{"theta_i": "src_z", "550": "value"}`.

    A ValueError says which column is missing or not known, and what to say.
    """
    places: dict[str, int] = {}
    bands: dict[float, int] = {}
    if said:
        for role, name in said.items():
            place = _place(names, name)
            if role in ROLES:
                places[role] = place
            elif (band := _wavelength(role, alone=True)) is not None:
                bands[band] = place
            else:
                raise ValueError(f"{role!r} is none of {', '.join(ROLES)} or a wavelength in nm")
    for place, name in enumerate(names):
        if place in places.values() or place in bands.values():
            continue
        known = _role(name)
        if (
            known is not None
            and known in ROLES
            and known not in places
            and not (said and known in VALUES)
        ):
            places[known] = place
        elif not said or not (bands or set(VALUES) & set(said)):
            band = _wavelength(name, alone=known is None)
            if band is not None and band not in bands:
                bands[band] = place
    if bands and "wavelength" not in places:
        for role in VALUES:
            if not (said and role in said):
                places.pop(role, None)
    used = {*places.values(), *bands.values()}
    unused = [name for place, name in enumerate(names) if place not in used and name]
    radians = {}
    for role in ANGLES:
        if role in places and (unit := _UNIT.search(names[places[role]])):
            radians[role] = (unit[1] or unit[2]).lower().startswith("rad")
    _check(names, places, bands)
    return Columns(places, bands, radians, unused)


def _check(names: Sequence[str], places: Mapping[str, int], bands: Mapping[float, int]) -> None:
    wanted = {
        "theta_i": "the angle of the light from the normal",
        "theta_o": "the angle of the viewer from the normal",
    }
    missing = [role for role in wanted if role not in places]
    if not bands and not {"f"} & set(places) and not {"r", "g", "b"} <= set(places):
        missing.append("f")
        wanted = wanted | {"f": "the values"}
    if missing:
        known = ", ".join(repr(name) for name in names[:12])[:300]
        what = ", ".join(f"{role} ({wanted[role]})" for role in missing)
        example = ",".join(f"{role}=NAME" for role in missing)
        raise ValueError(
            f"columns {known}: none is known as {what}; say which with --columns {example}, or "
            "name them theta_i,phi_i,theta_o,phi_o,r,g,b"
        )


def _place(names: Sequence[str], name: str) -> int:
    """A column by its name, in any case, or its number from 1."""
    lower = [each.lower() for each in names]
    if name.lower() in lower:
        return lower.index(name.lower())
    if name.isascii() and name.isdecimal() and 1 <= int(name[:6]) <= len(names):
        return int(name[:6]) - 1
    hint = did_you_mean(name, names, f"known: {', '.join(names[:20])[:200]}")
    raise ValueError(f"there is no column {name[:80]!r}{hint}")


def _role(name: str) -> str | None:
    """What a column holds by its name; None where that does not tell."""
    plain = _UNIT.sub(" ", name).lower()
    if plain.strip() in ROLES:
        return plain.strip()
    spaced = re.sub(r"(theta|phi|zenith|azimuth|angle)", r" \1 ", plain)
    tokens = [token for token in re.split(r"[^a-zµμ]+", spaced) if token]
    words = set(tokens)
    if not words:
        return None
    if words & _WAVELENGTH:
        return "wavelength"
    azimuth, zenith = bool(words & _AZIMUTH), bool(words & _ZENITH)
    light, view = bool(words & _LIGHT), bool(words & _VIEW)
    if (azimuth and words & _RELATIVE) or words & {"raa", "dphi"}:
        return "phi"
    if light != view and (azimuth or zenith or words <= _ALONE):
        side = "i" if light else "o"
        return f"phi_{side}" if azimuth and not zenith else f"theta_{side}"
    if azimuth and not light and not view and not zenith:
        return "phi"
    if words & _SPREAD and not (words & _VALUE and not words & {"sigma", "std", "uncertainty"}):
        return "sigma"
    if words <= set(_COLORS) and len(words) == 1:
        return _COLORS[tokens[0]]
    if words & _VALUE and not _BAND.search(name) and not _MICRONS.search(name):
        return "f"
    return None


def _wavelength(name: str, *, alone: bool) -> float | None:
    """A wavelength in nm in the name of a column; numbers without a unit only if `alone`."""
    if match := _BAND.search(name):
        return float(match[1])
    if match := _MICRONS.search(name):
        return round(1000.0 * float(match[1]), 6)
    if alone and (match := _NUMBER.fullmatch(name) or _PREFIXED.fullmatch(name)):
        return float(match[1])
    return None
