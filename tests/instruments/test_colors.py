"""Colors against published pairs and colour-science."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.instruments import ILLUMINANTS, OBSERVERS, ciede2000, xyz_to_lab
from nacre.instruments.illuminants import nodes, rgb_weights, spectral_weights, xyz_per_node

PAIRS = np.array(
    [
        (50, 2.6772, -79.7751, 50, 0, -82.7485, 2.0425),
        (50, 3.1571, -77.2803, 50, 0, -82.7485, 2.8615),
        (50, 2.8361, -74.02, 50, 0, -82.7485, 3.4412),
        (50, -1.3802, -84.2814, 50, 0, -82.7485, 1),
        (50, -1.1848, -84.8006, 50, 0, -82.7485, 1),
        (50, -0.9009, -85.5211, 50, 0, -82.7485, 1),
        (50, 0, 0, 50, -1, 2, 2.3669),
        (50, -1, 2, 50, 0, 0, 2.3669),
        (50, 2.49, -0.001, 50, -2.49, 0.0009, 7.1792),
        (50, 2.49, -0.001, 50, -2.49, 0.001, 7.1792),
        (50, 2.49, -0.001, 50, -2.49, 0.0011, 7.2195),
        (50, 2.49, -0.001, 50, -2.49, 0.0012, 7.2195),
        (50, -0.001, 2.49, 50, 0.0009, -2.49, 4.8045),
        (50, -0.001, 2.49, 50, 0.001, -2.49, 4.8045),
        (50, -0.001, 2.49, 50, 0.0011, -2.49, 4.7461),
        (50, 2.5, 0, 50, 0, -2.5, 4.3065),
        (50, 2.5, 0, 73, 25, -18, 27.1492),
        (50, 2.5, 0, 61, -5, 29, 22.8977),
        (50, 2.5, 0, 56, -27, -3, 31.9030),
        (50, 2.5, 0, 58, 24, 15, 19.4535),
        (50, 2.5, 0, 50, 3.1736, 0.5854, 1),
        (50, 2.5, 0, 50, 3.2972, 0, 1),
        (50, 2.5, 0, 50, 1.8634, 0.5757, 1),
        (50, 2.5, 0, 50, 3.2592, 0.335, 1),
        (60.2574, -34.0099, 36.2677, 60.4626, -34.1751, 39.4387, 1.2644),
        (63.0109, -31.0961, -5.8663, 62.8187, -29.7946, -4.0864, 1.2630),
        (61.2901, 3.7196, -5.3901, 61.4292, 2.2480, -4.9620, 1.8731),
        (35.0831, -44.1164, 3.7933, 35.0232, -40.0716, 1.5901, 1.8645),
        (22.7233, 20.0904, -46.6940, 23.0331, 14.9730, -42.5619, 2.0373),
        (36.4612, 47.8580, 18.3852, 36.2715, 50.5065, 21.2231, 1.4146),
        (90.8027, -2.0831, 1.4410, 91.1528, -1.6435, 0.0447, 1.4441),
        (90.9257, -0.5406, -0.9208, 88.6381, -0.8985, -0.7239, 1.5381),
        (6.7747, -0.2908, -2.4247, 5.8714, -0.0985, -2.2286, 0.6377),
        (2.0776, 0.0795, -1.1350, 0.9033, -0.0636, -0.5514, 0.9082),
    ]
)
"""L*, a*, b* of two colors and their difference (Sharma, Wu and Dalal 2005, table 1)."""

WHITES = {
    ("D65", 2): (95.04, 100.0, 108.88),
    ("D65", 10): (94.81, 100.0, 107.32),
    ("A", 2): (109.85, 100.0, 35.58),
    ("A", 10): (111.14, 100.0, 35.20),
    ("F11", 2): (100.96, 100.0, 64.35),
    ("F11", 10): (103.86, 100.0, 65.61),
    ("C", 2): (98.07, 100.0, 118.22),
}
"""XYZ of the white (ASTM E308, tables 5, at 5 nm)."""


def test_ciede2000_of_the_published_pairs():
    assert len(PAIRS) == 34
    first, second, expected = PAIRS[:, :3], PAIRS[:, 3:6], PAIRS[:, 6]
    np.testing.assert_allclose(ciede2000(first, second), expected, atol=5e-5)
    np.testing.assert_allclose(ciede2000(second, first), expected, atol=5e-5)


@pytest.mark.parametrize(("illuminant", "observer"), list(WHITES))
def test_white_points(illuminant, observer):
    white = xyz_per_node(illuminant, observer).sum(axis=0)
    np.testing.assert_allclose(white, WHITES[illuminant, observer], atol=0.02)


@pytest.mark.parametrize("illuminant", ILLUMINANTS)
@pytest.mark.parametrize("observer", OBSERVERS)
def test_a_gray_is_gray_under_every_light(illuminant, observer):
    weights = rgb_weights(illuminant, observer)
    lab = xyz_to_lab(np.full(3, 0.2) @ weights, weights.sum(axis=0))
    np.testing.assert_allclose(lab, (51.837, 0.0, 0.0), atol=1e-3)


def test_assumed_spectra_have_the_colors_that_they_are_assumed_for():
    from nacre.color import primaries

    recovered = np.stack(primaries(nodes())) @ xyz_per_node("D65", 2)
    np.testing.assert_allclose(recovered, rgb_weights("D65", 2), atol=0.15)


def test_bands_between_nodes_share_the_spectrum():
    bands = np.array([400.0, 452.0, 553.0, 557.0, 700.0])
    weights = spectral_weights(bands, "A", 10)
    np.testing.assert_allclose(weights.sum(axis=0), xyz_per_node("A", 10).sum(axis=0))


def test_unknown_lights_and_observers_are_refused():
    with pytest.raises(ValueError, match="one of D65, A, F11, got 'D50'"):
        rgb_weights("D50", 2)
    with pytest.raises(ValueError, match="2 or 10 degrees, got 4"):
        rgb_weights("D65", 4)


def test_against_colour_science():
    colour = pytest.importorskip("colour")
    rng = np.random.default_rng(3)
    spectrum = np.interp(nodes(), np.linspace(380, 780, 9), rng.uniform(0.0, 1.0, 9))
    reflectance = colour.SpectralDistribution(dict(zip(nodes(), spectrum, strict=True)))
    lab = rng.uniform((0, -80, -80), (100, 80, 80), (2, 500, 3))
    np.testing.assert_allclose(
        ciede2000(*lab), colour.delta_E(*lab, method="CIE 2000"), rtol=1e-9, atol=1e-9
    )
    shape = colour.SpectralShape(380, 780, 5)
    observers = {
        2: colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape),
        10: colour.MSDS_CMFS["CIE 1964 10 Degree Standard Observer"].copy().align(shape),
    }
    for illuminant in ILLUMINANTS:
        name = "FL11" if illuminant == "F11" else illuminant
        light = colour.SDS_ILLUMINANTS[name].copy().align(shape)
        for observer in OBSERVERS:
            expected = colour.sd_to_XYZ(
                reflectance, observers[observer], light, method="Integration"
            )
            weights = xyz_per_node(illuminant, observer)
            np.testing.assert_allclose(spectrum @ weights, expected, rtol=1e-6)
            white = weights.sum(axis=0)
            xy = white[:2] / white.sum()
            found = xyz_to_lab(spectrum @ weights, white)
            np.testing.assert_allclose(found, colour.XYZ_to_Lab(expected / 100.0, xy), rtol=1e-6)
