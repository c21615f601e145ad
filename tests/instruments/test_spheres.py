"""Spheres, 45:0 and multi-angle instruments against closed forms and a fine grid."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nacre.analytic import MODELS
from nacre.brdf import Brdf
from nacre.geometry import from_spherical, join
from nacre.instruments import (
    BLACK_GLASS,
    E2194,
    E2539,
    Geometry,
    Mirror,
    bidirectional,
    directional_hemispherical,
    multiangle,
    sphere,
)
from nacre.instruments.hemisphere import hemisphere, trap
from tests.instruments.surfaces import ggx, ggx_values

GRAY = MODELS["lambert"](diffuse=(0.5, 0.5, 0.5))


def on_a_grid(roughness: float, angle: float, count: int = 1000) -> tuple[np.ndarray, np.ndarray]:
    """Directions of a grid in polar angle and azimuth, and the flux of GGX toward each."""
    theta = 0.5 * math.pi * (np.arange(count) + 0.5) / count
    phi = math.pi * (np.arange(count) + 0.5) / count
    wo = join(from_spherical(*np.meshgrid(theta, phi, indexing="ij")))
    light = join(from_spherical(np.float64(math.radians(angle)), np.float64(0.0)))
    solid = np.sqrt(1.0 - wo[..., 2] ** 2) * 2.0 * (0.5 * math.pi / count) * (math.pi / count)
    return wo, ggx_values(light, wo, roughness) * wo[..., 2] * solid


@pytest.mark.parametrize("angle", [0.0, 8.0, 45.0, 70.0, 85.0, 89.0])
def test_nodes_of_the_hemisphere_integrate_cosines(angle):
    fixed = join(from_spherical(np.float64(math.radians(angle)), np.float64(0.7)))
    w, solid = hemisphere(fixed)
    assert w[:, 2].min() > 0.0
    assert solid.sum() == pytest.approx(2.0 * math.pi, rel=1e-4)
    assert solid @ w[:, 2] == pytest.approx(math.pi, rel=1e-4)
    assert solid @ w[:, 0] == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("offset", [0.0, 2.0, 5.0])
def test_nodes_of_the_trap_integrate_cosines(offset):
    center = np.array([math.sin(0.14), 0.0, math.cos(0.14)])
    peak = np.array([math.sin(0.14), 0.0, math.cos(0.14)])
    turn = math.radians(offset)
    peak = math.cos(turn) * peak + math.sin(turn) * np.array([0.0, 1.0, 0.0])
    w, solid = trap(center, math.radians(6.0), peak)
    assert (w @ center).min() >= math.cos(math.radians(6.0)) - 1e-12
    assert solid.sum() == pytest.approx(2.0 * math.pi * (1.0 - math.cos(math.radians(6.0))))
    expected = math.pi * math.sin(math.radians(6.0)) ** 2 * math.cos(0.14)
    assert solid @ w[:, 2] == pytest.approx(expected)


@pytest.mark.parametrize("roughness", [0.02, 0.1, 0.5])
@pytest.mark.parametrize("angle", [8.0, 60.0])
def test_directional_hemispherical_reflectance_is_that_of_a_fine_grid(roughness, angle):
    expected = 100.0 * on_a_grid(roughness, angle)[1].sum()
    found = directional_hemispherical(ggx(roughness), angle).xyz[1]
    assert found == pytest.approx(expected, rel=2e-3)


def test_gray_reads_half_at_every_angle_and_in_the_sphere():
    found = sphere(GRAY)
    trapped = 50.0 * math.sin(math.radians(6.0)) ** 2 * math.cos(math.radians(8.0))
    assert found.included.xyz[1] == pytest.approx(50.0, rel=1e-5)
    assert found.excluded.xyz[1] == pytest.approx(50.0 - trapped, rel=1e-5)
    for angle in (0.0, 30.0, 60.0, 85.0):
        assert directional_hemispherical(GRAY, angle).xyz[1] == pytest.approx(50.0, rel=2e-4)


def test_the_trap_takes_all_that_is_mirrored():
    for mirror, reflectance in ((Mirror(), 100.0), (BLACK_GLASS, 4.8776)):
        found = sphere(mirror)
        assert found.included.xyz[1] == pytest.approx(reflectance, rel=1e-3)
        assert found.excluded.xyz[1] == pytest.approx(0.0, abs=1e-9)
    near = sphere(ggx(0.001))
    assert near.included.xyz[1] == pytest.approx(100.0, rel=1e-3)
    assert near.excluded.xyz[1] == pytest.approx(0.0, abs=0.2)


def midpoints(inner: float, outer: float, counts: tuple[int, int]) -> np.ndarray:
    """Directions of equal solid angles between cones about the normal, (n, 3)."""
    low, high = math.cos(math.radians(outer)), math.cos(math.radians(inner))
    z = low + (high - low) * (np.arange(counts[0]) + 0.5) / counts[0]
    phi = 2.0 * math.pi * (np.arange(counts[1]) + 0.5) / counts[1]
    return join(from_spherical(*np.meshgrid(np.arccos(z), phi, indexing="ij"))).reshape(-1, 3)


def test_the_trap_leaves_what_a_fine_grid_has_outside():
    sine, cosine = math.sin(math.radians(8.0)), math.cos(math.radians(8.0))
    views = midpoints(0.0, 5.0, (3, 8)) @ np.array(
        [[cosine, 0, -sine], [0, 1, 0], [sine, 0, cosine]]
    )
    theta = 0.5 * math.pi * (np.arange(400) + 0.5) / 400
    phi = 2.0 * math.pi * (np.arange(600) + 0.5) / 600
    wi = join(from_spherical(*np.meshgrid(theta, phi, indexing="ij"))).reshape(-1, 3)
    weights = np.repeat(np.sin(theta), 600) * wi[:, 2] * (0.5 * math.pi / 400) * (math.pi / 300)
    kept = wi @ np.array([-sine, 0.0, cosine]) < math.cos(math.radians(6.0))
    wi, weights = wi[kept], weights[kept]
    outside = sum(wo[2] * float(ggx_values(wi, wo, 0.1) @ weights) for wo in views)
    expected = 100.0 * outside / views[:, 2].sum()
    assert sphere(ggx(0.1)).excluded.xyz[1] == pytest.approx(expected, rel=2e-3)


def test_45_0_of_a_diffuse_surface_and_of_a_mirror():
    found = bidirectional(GRAY)
    for color in (found.annular, found.directional):
        assert color.xyz[1] == pytest.approx(50.0, rel=1e-6)
        assert color.lab == pytest.approx((76.069, 0.0, 0.0), abs=1e-3)
    assert bidirectional(ggx(0.01)).annular.xyz[1] < 0.2


@pytest.mark.parametrize("roughness", [0.1, 0.5])
def test_45_0_of_ggx_is_that_of_a_fine_grid(roughness):
    light, view = midpoints(40.0, 50.0, (40, 48)), midpoints(0.0, 5.0, (6, 12))
    values = [float(ggx_values(light, wo, roughness) @ light[:, 2]) * wo[2] for wo in view]
    expected = 100.0 * math.pi * sum(values) / (light[:, 2].sum() * view[:, 2].sum())
    assert bidirectional(ggx(roughness)).annular.xyz[1] == pytest.approx(expected, rel=2e-3)


DETECTORS = {
    "45as15": (30.0, 180.0),
    "45as45": (0.0, 180.0),
    "45as75": (30.0, 0.0),
    "45as110": (65.0, 0.0),
    "45as-15": (60.0, 180.0),
    "15as-45": (60.0, 180.0),
    "15as80": (65.0, 0.0),
    "45as25az90": (50.144, 146.597),
    "15as38.3az43": (50.144, 146.597),
    "45as60az125.3": (45.0, 90.0),
    "15as46.9az104.5": (45.0, 90.0),
}
"""Polar angle and azimuth of the view in degrees. Two detectors outside of the plane serve both
lights."""


def test_views_of_multiangle_instruments():
    named = {geometry.name: geometry for geometry in E2539}
    assert len(named) == 19
    assert set(E2194) < set(E2539)
    for name, angles in DETECTORS.items():
        wi, wo = named[name].directions()
        theta, phi = map(math.radians, angles)
        expected = join(from_spherical(np.float64(theta), np.float64(phi)))
        np.testing.assert_allclose(wo, expected, atol=2e-3, err_msg=name)
        assert wi[0] == pytest.approx(math.sin(math.radians(named[name].light)))
        assert np.linalg.norm(wo) == pytest.approx(1.0)


def test_flop_index_is_alman_s():
    flakes = MODELS["ggx"](diffuse=(0.05,) * 3, specular=(0.4,) * 3, roughness=0.3)
    found = multiangle(flakes)
    lightness = dict(
        zip([g.aspecular for g in E2194], [c.lab[0] for c in found.colors], strict=True)
    )
    expected = 2.69 * (lightness[15] - lightness[110]) ** 1.11 / lightness[45] ** 0.86
    assert found.flop_index == pytest.approx(expected)
    assert multiangle(GRAY).flop_index == pytest.approx(0.0, abs=1e-9)
    assert multiangle(flakes, E2194[:2]).flop_index is None
    first = found.colors[1].xyz[1]
    wi, wo = Geometry(45.0, 15.0).directions()
    assert first == pytest.approx(100.0 * math.pi * float(flakes.eval(wi, wo)[1]), rel=1e-9)


class Spectral(Brdf):
    """A diffuse surface whose spectrum is a ramp."""

    wavelengths = np.array([400.0, 500.0, 600.0, 700.0])

    def eval_components(self, wi, wo):
        value = 0.5 / math.pi + 0.0 * (wi[2] + wo[2])
        return value, value, value

    def eval_bands(self, wi, wo):
        return np.broadcast_to(np.array([0.1, 0.2, 0.6, 0.8]) / math.pi, (len(wi), 4))


def test_spectra_are_integrated():
    from nacre.instruments.illuminants import nodes, xyz_per_node

    ramp = np.interp(nodes(), Spectral.wavelengths, [0.1, 0.2, 0.6, 0.8])
    for illuminant, observer in (("D65", 2), ("A", 10), ("F11", 10)):
        color = bidirectional(
            Spectral(name="ramp"), illuminant=illuminant, observer=observer
        ).annular
        assert color.xyz == pytest.approx(ramp @ xyz_per_node(illuminant, observer))
        assert not color.estimated
        assert color.difference(color) == 0.0


def test_colors_of_rgb_say_where_they_are_estimates():
    red = MODELS["lambert"](diffuse=(0.5, 0.1, 0.1))
    exact, under_a = (sphere(red, illuminant=name).included for name in ("D65", "A"))
    assert not exact.estimated
    assert under_a.estimated
    assert under_a.lab[0] > exact.lab[0]  # a red is lighter in the light of a bulb
    assert 0.0 <= exact.hue < 360.0
    assert exact.chroma == pytest.approx(math.hypot(*exact.lab[1:]))


def test_angles_of_incidence_out_of_range_are_refused():
    with pytest.raises(ValueError, match="0 to below 90, got 90"):
        directional_hemispherical(GRAY, 90.0)
