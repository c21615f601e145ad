"""Mixtures of GGX lobes to test with."""

from __future__ import annotations

from nacre.sampling import GgxLobe, GgxMixture

_ROUGH = GgxLobe((0.2, 0.5, 0.3), (0.3, 0.4, 0.6), (0.5, 0.3, 0.7), (0.9, -0.3, 0.2))
_SHARP = GgxLobe((0.3, 0.2, 0.4), (0.05, 0.02, 0.06), (0.1, 0.03, 0.06), (-0.5, 0.3, 0.0))
_COSINES = (0.1, 0.5, 1.0)


def steady(share: float, roughness: float, shift: float = 0.0) -> GgxMixture:
    """One isotropic lobe that does not depend on the view but by its shift."""
    return GgxMixture((GgxLobe((share,), (roughness,), (roughness,), (shift,)),))


MIXTURES = {
    "diffuse": GgxMixture(steady(0.0, 0.5).lobes, (0.3,), (0.4,)),
    "rough": steady(1.0, 0.8),
    "sharp": steady(1.0, 0.0045),
    "sharp and diffuse": steady(0.5, 0.02),
    "shifted": steady(0.9, 0.15, -1.0),
    "of the view": GgxMixture((_ROUGH,), (0.1, 0.05, 0.2), (0.1, 0.1, 0.1), _COSINES),
    "two lobes": GgxMixture((_ROUGH, _SHARP), (0.1, 0.05, 0.2), (0.1, 0.1, 0.1), _COSINES),
    "of a fixed axis": GgxMixture((_ROUGH,), (0.1,) * 3, (0.0,) * 3, _COSINES, 0.7),
}
"""Sharp and broad, of one lobe and of two, constant and changing with the view."""
