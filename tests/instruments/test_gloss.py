"""Glossmeters and haze meters against closed forms and a fine grid."""

from __future__ import annotations

import math

import numpy as np
import pytest

import nacre
from nacre.analytic import MODELS
from nacre.brdf import Brdf
from nacre.instruments import BLACK_GLASS, Mirror, bidirectional, gloss, haze
from nacre.instruments.glossmeter import RECEPTORS, SOURCE
from nacre.instruments.hazemeter import BANDS, log_haze
from tests.instruments.surfaces import BLACK, WHITE, Polished, ggx, ggx_values

ANGLES = sorted(RECEPTORS)
FRESNEL = {20.0: 0.04908, 60.0: 0.10006, 85.0: 0.61915}
"""Reflectance of glass of index 1.567 for unpolarized light, by Fresnel's equations."""
WHITE_SURFACE = MODELS["lambert"](diffuse=WHITE)


def fresnel(angle: float) -> float:
    """The same, from the angles of the rays."""
    inside = math.asin(math.sin(math.radians(angle)) / 1.567)
    outside = math.radians(angle)
    s = math.sin(outside - inside) / math.sin(outside + inside)
    p = math.tan(outside - inside) / math.tan(outside + inside)
    return 0.5 * (s * s + p * p)


def corners(angle: float, edges: tuple[float, float]) -> np.ndarray:
    """Directions of the corners of an aperture, in order, (4, 3)."""
    x, y = (math.tan(math.radians(0.5 * edge)) for edge in edges)
    sine, cosine = math.sin(math.radians(angle)), math.cos(math.radians(angle))
    signs = ((1, 1), (1, -1), (-1, -1), (-1, 1))
    found = np.array([(a * x * cosine + sine, b * y, cosine - a * x * sine) for a, b in signs])
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def projected(angle: float, edges: tuple[float, float]) -> float:
    """Integral of cos(theta) over an aperture, by Lambert's formula for polygons."""
    total, around = 0.0, corners(angle, edges)
    for a, b in zip(around, np.roll(around, -1, axis=0), strict=True):
        cross = np.cross(a, b)
        total += math.acos(a @ b) * cross[2] / np.linalg.norm(cross)
    return abs(0.5 * total)


def on_a_grid(roughness: float, angle: float, receptors, count: int = 120) -> float:
    """Gloss or haze of GGX by the midpoint rule, in coordinates of the field stops."""

    def midpoints(polar, edges, counts):
        grids = []
        for edge, number in zip(edges, counts, strict=True):
            half = math.tan(math.radians(0.5 * edge))
            grids.append(half * (2.0 * (np.arange(number) + 0.5) / number - 1.0))
        x, y = (grid.reshape(-1) for grid in np.meshgrid(*grids, indexing="ij"))
        sine, cosine = math.sin(math.radians(polar)), math.cos(math.radians(polar))
        w = np.stack([x * cosine + sine, y, cosine - x * sine], axis=1)
        length = np.linalg.norm(w, axis=1)
        area = 4.0 * math.prod(math.tan(math.radians(0.5 * edge)) for edge in edges)
        return w / length[:, None], area / len(x) / length**3

    light, solid = midpoints(angle, SOURCE, (6, 12))
    half = light[:, 1] > 0.0  # the other half reads the same
    light, solid = light[half], 2.0 * solid[half]
    total = 0.0
    for center in receptors:
        view, seen = midpoints(-center, RECEPTORS[angle], (count, count))
        for wi, weight in zip(light, solid, strict=True):
            values = ggx_values(wi[None], view, roughness)
            total += float(values @ (seen * view[:, 2])) * wi[2] * weight
    glass = [fresnel(math.degrees(math.acos(cosine))) for cosine in light[:, 2]]
    return 100.0 * total / float(solid @ (light[:, 2] * glass))


@pytest.mark.parametrize("angle", ANGLES)
def test_black_glass_reads_100(angle):
    assert fresnel(angle) == pytest.approx(FRESNEL[angle], abs=1e-5)
    assert gloss(BLACK_GLASS, angle).value == pytest.approx(100.0, abs=1e-9)
    assert gloss(Polished(1.567), angle).value == pytest.approx(100.0, abs=0.5)


@pytest.mark.parametrize("angle", ANGLES)
def test_a_perfect_mirror_reads_the_inverse_of_the_glass(angle):
    # The glass reflects a little more or less across the source's image.
    assert gloss(Mirror(), angle).value == pytest.approx(100.0 / fresnel(angle), rel=1.5e-3)


@pytest.mark.parametrize("angle", ANGLES)
def test_a_diffuse_surface_reads_what_lamberts_law_gives(angle):
    expected = 100.0 * projected(angle, RECEPTORS[angle]) / math.pi / fresnel(angle)
    assert gloss(WHITE_SURFACE, angle).value == pytest.approx(expected, rel=1.5e-3)


@pytest.mark.parametrize("roughness", [0.02, 0.05, 0.1, 0.2, 0.5])
@pytest.mark.parametrize("angle", ANGLES)
def test_ggx_reads_what_a_fine_grid_gives(roughness, angle):
    expected = on_a_grid(roughness, angle, [angle])
    assert gloss(ggx(roughness), angle).value == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("roughness", [0.02, 0.1, 0.5])
def test_haze_of_ggx_is_what_a_fine_grid_gives(roughness):
    found = haze(ggx(roughness))
    assert found.value == pytest.approx(on_a_grid(roughness, 20.0, BANDS), rel=2e-3)
    assert found.gloss == gloss(ggx(roughness), 20).value


def test_haze_of_mirrors_and_of_diffuse_surfaces():
    assert haze(BLACK_GLASS).value == 0.0
    assert haze(BLACK_GLASS).log == 0.0
    assert haze(Polished(1.567)).value < 1e-6
    white = haze(WHITE_SURFACE)
    both = sum(projected(angle, RECEPTORS[20.0]) for angle in BANDS)
    assert white.value == pytest.approx(100.0 * both / math.pi / fresnel(20.0), rel=1.5e-3)
    assert white.compensated == pytest.approx(0.0, abs=1e-6)
    assert log_haze(20.0) == pytest.approx(1285.0 * math.log10(2.0))


def test_brushed_metal_has_other_gloss_along_and_across():
    brushed = MODELS["ggx-anisotropic"](
        diffuse=BLACK, specular=WHITE, roughness_x=0.05, roughness_y=0.4, angle=0.0
    )
    along, across = (gloss(brushed, 60, azimuth=azimuth).value for azimuth in (0.0, 90.0))
    again = MODELS["ggx-anisotropic"](
        diffuse=BLACK, specular=WHITE, roughness_x=0.4, roughness_y=0.05, angle=0.0
    )
    assert across == pytest.approx(gloss(again, 60).value, rel=1e-6)
    assert abs(along - across) > 0.2 * along


class Limited(Brdf):
    """White, and known up to 60 degrees from the normal."""

    def eval_components(self, wi, wo):
        value = 1.0 / math.pi + 0.0 * (wi[2] + wo[2])
        return value, value, value

    def valid_components(self, wi, wo):
        return (wi[2] > 0.5) & (wo[2] > 0.5)


def test_readings_tell_how_much_of_them_is_known():
    assert gloss(Limited(name="limited"), 20).known == 1.0
    assert 0.2 < gloss(Limited(name="limited"), 60).known < 0.3
    assert gloss(Limited(name="limited"), 85).known == 0.0


def test_what_cannot_be_read_is_refused():
    with pytest.raises(ValueError, match="20, 60 or 85 degrees, not 45"):
        gloss(BLACK_GLASS, 45)
    infrared = type("Infrared", (Limited,), {"channels": ("905 nm", "850 nm", "850 nm")})
    with pytest.raises(
        nacre.NacreError, match=r"far: its bands make no color \(905 nm, 850 nm\); choose one"
    ):
        gloss(infrared(name="far"), 60)


def test_one_band_has_gloss_and_no_color():
    laser = type("Laser", (Limited,), {"channels": ("650 nm",) * 3})(name="laser")
    assert gloss(laser, 20) == gloss(Limited(name="white"), 20)
    assert haze(laser) == haze(Limited(name="white"))
    with pytest.raises(nacre.NacreError, match=r"laser: its bands make no color \(650 nm\)"):
        bidirectional(laser)
