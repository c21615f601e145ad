"""The Principled BSDF: against Cycles, and its energy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from nacre.array import Table
from nacre.standard.lookup import interpolate
from nacre.standard.metal_fresnel import metal, metal_at_82, metal_dip
from nacre.standard.principled import AnisotropicFilmPrincipled, Principled
from tests.oracles import blender, principled
from tests.targets.support import needs

NODE = {p.name: principled.PLAIN[p.name] for p in Principled.parameters}
WHITE = (1.0, 1.0, 1.0)
COLORS = [p.name for p in Principled.parameters if p.color]


def albedo(cosine: float, **changes) -> np.ndarray:
    """Of a node, by the midpoint rule over the light's projected hemisphere."""
    values = {k: (v,) * 3 if k in COLORS else v for k, v in NODE.items()} | changes
    r = np.sqrt((np.arange(400) + 0.5) / 400)
    phi = (np.arange(400) + 0.5) * np.pi / 200
    r, phi = (x.reshape(-1) for x in np.meshgrid(r, phi, indexing="ij"))
    wi = np.stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(1.0 - r * r)], -1)
    wo = np.broadcast_to([np.sqrt(1.0 - cosine**2), 0.0, cosine], wi.shape)
    return np.pi * Principled(**values).eval(wi, wo).mean(axis=0)


@pytest.mark.parametrize("cosine", [0.3, 0.9])
@pytest.mark.parametrize("roughness", [0.5, 0.95])
def test_white_metal_reflects_everything(roughness, cosine):
    found = albedo(cosine, base_color=WHITE, metallic=1.0, roughness=roughness)
    np.testing.assert_allclose(found, 1.0, atol=4e-3)


def test_layers_share_the_light():
    layers = {"specular_ior_level": 0.5, "coat_weight": 1.0, "coat_roughness": 0.4}
    for cosine in (0.2, 0.6, 1.0):
        found = albedo(cosine, base_color=WHITE, sheen_weight=1.0, **layers)
        assert found.max() < 1.02  # what lies below is estimated
        assert found.min() > 0.9


def test_a_metal_has_its_tint_at_82_degrees():
    normal, tint = 0.4, 0.6
    dip = metal_dip(normal, metal_at_82(normal) * tint)
    schlick = normal + (1 - normal) * (6 / 7) ** 5
    assert float(metal(np.array(1 / 7), normal, dip)) == pytest.approx(tint * schlick)
    assert float(metal(np.array(1.0), normal, dip)) == pytest.approx(normal)


def test_tables_are_read_linearly_whatever_is_constant():
    random = np.random.default_rng(0)
    values = random.random((4, 3, 5))
    table = Table(values)
    expected = RegularGridInterpolator([np.linspace(0, 1, n) for n in values.shape], values)
    points = random.random((50, 3))
    np.testing.assert_allclose(interpolate(table, *points.T), expected(points), rtol=1e-6)
    points[:, (0, 2)] = 0.3, 0.85
    found = interpolate(table, 0.3, points[:, 1], 0.85)
    np.testing.assert_allclose(found, expected(points), rtol=1e-6)
    assert interpolate(table, 0.3, 2.0, 1) == pytest.approx(expected((0.3, 1.0, 1.0))[()])


@pytest.mark.parametrize(
    ("case", "median", "most"),
    [("all", 3e-4, 2e-3), ("anisotropic metal", 1e-4, 2e-3), ("all and a film", 2e-3, 0.015)],
)
def test_cycles_renders_what_we_compute(case, median, most):
    needs(blender.missing())
    found = principled.case(case, 256, np.random.default_rng(1))
    assert np.median(found) < median
    assert np.quantile(found, 0.95) < most


def test_every_input_is_one_of_the_study():
    assert {p.name for p in AnisotropicFilmPrincipled.parameters} == principled.PLAIN.keys()
