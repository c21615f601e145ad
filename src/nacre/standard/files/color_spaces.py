"""Color spaces that MaterialX, USD and OpenColorIO name, as linear Rec. 709.

A name is made of a curve, primaries and, perhaps, what the image is of: `lin_ap1_scene`,
`srgb_rec709`, `g22_adobergb_scene` (Color Interop Forum, "Color Space Encodings for Texture Assets
and CG Rendering"). MaterialX 1.39 has older names beside them (specification, "Color Spaces and
Color Management Systems"). Whites are adapted as there, by Bradford's matrix.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from nacre.array import Doubles
from nacre.color import REC_709, rgb_to_xyz_matrix, srgb_to_linear, xyz_to_rgb
from nacre.errors import FormatError

_D65, _ACES = (0.3127, 0.3290), (0.32168, 0.33767)
_P3 = ((0.680, 0.320), (0.265, 0.690), (0.150, 0.060), _D65)
_PRIMARIES = {
    "rec709": REC_709,
    "rec2020": ((0.708, 0.292), (0.170, 0.797), (0.131, 0.046), _D65),
    "p3d65": _P3,
    "displayp3": _P3,
    "adobergb": ((0.64, 0.33), (0.21, 0.71), (0.15, 0.06), _D65),
    "ap0": ((0.7347, 0.2653), (0.0, 1.0), (0.0001, -0.0770), _ACES),
    "ap1": ((0.713, 0.293), (0.165, 0.830), (0.128, 0.044), _ACES),
}
"""x and y of red, green, blue and white (ITU-R BT.709 and BT.2020, SMPTE RP 431-2, Adobe RGB
(1998), SMPTE ST 2065-1, AMPAS S-2014-004)."""

_XYZ = "ciexyzd65"
_CURVES = {"lin": 1.0, "g18": 1.8, "g22": 2.2, "g24": 2.4, "g26": 2.6, "srgb": 0.0}
_ADOBE = 563.0 / 256.0  # the exponent of Adobe RGB (1998), which names round to 2.2
_NAME = re.compile(rf"({'|'.join(_CURVES)})_({'|'.join([*_PRIMARIES, _XYZ])})(_scene|_display)?")
_OTHER_NAMES = {
    **dict.fromkeys(("", "none", "raw", "data", "unknown", "identity"), "lin_rec709"),
    **dict.fromkeys(("lin_srgb", "lin_rec709_srgb"), "lin_rec709"),
    **dict.fromkeys(("srgb_texture", "srgb_tx", "srgb"), "srgb_rec709"),
    "acescg": "lin_ap1",
    "aces2065-1": "lin_ap0",
    "adobergb": "g22_adobergb",
    "rec709_display": "g24_rec709",
}
_BRADFORD = np.array(
    [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]
)


def to_rec_709(color: Sequence[float], space: str) -> Doubles:
    """A color in linear Rec. 709, shape (3,); it may leave [0, 1] where that of the space does not.

    Encoded values below 0 count as 0, as in MaterialX, but for the straight start of sRGB's curve.
    Raises FormatError if the space is not known.
    """
    plain = space.strip().lower()
    found = _NAME.fullmatch(_OTHER_NAMES.get(plain, plain))
    if found is None:
        known = "acescg, srgb_texture, and names like lin_rec709, g22_ap1, srgb_p3d65_scene"
        raise FormatError(f"color space {space[:40]!r} is none of those read: {known}")
    curve, primaries = found[1], found[2]
    encoded = np.asarray(color, np.float64)
    if curve == "srgb":
        bright = srgb_to_linear(np.maximum(encoded, 0.0))
        linear = np.where(encoded < 0.0, encoded / 12.92, bright)
    elif curve == "lin":
        linear = encoded
    else:
        exponent = _ADOBE if (curve, primaries) == ("g22", "adobergb") else _CURVES[curve]
        linear = np.maximum(encoded, 0.0) ** exponent
    return linear if primaries == "rec709" else _matrix(primaries) @ linear


def _matrix(primaries: str) -> Doubles:
    """From linear RGB of some primaries to that of Rec. 709, shape (3, 3)."""
    if primaries == _XYZ:
        return xyz_to_rgb(np.eye(3)).T
    chromaticities = _PRIMARIES[primaries]
    cones = [_BRADFORD @ _white(xy) for xy in (chromaticities[3], _D65)]
    adapted = np.linalg.solve(_BRADFORD, (cones[1] / cones[0])[:, None] * _BRADFORD)
    return np.asarray(xyz_to_rgb((adapted @ rgb_to_xyz_matrix(chromaticities)).T).T)


def _white(xy: tuple[float, float]) -> Doubles:
    x, y = xy
    return np.array([x / y, 1.0, (1.0 - x - y) / y])
