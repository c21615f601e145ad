"""Closure mixtures: the formula against other models' and generated shaders, and the fit."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nacre.analytic import Ggx
from nacre.analytic.lambert import Lambert
from nacre.mitsuba.environment import load_environment
from nacre.mitsuba.lights import DirectionalLight
from nacre.mitsuba.sphere import SIZE, render_sphere
from nacre.runtime.progress import silent
from nacre.sampling.energy import albedos
from nacre.standard import closure_fit
from nacre.standard.closures import NODES, Closures
from nacre.targets import TARGETS
from tests.analytic.materials import EXAMPLES
from tests.data import require_data
from tests.measured.support import hemisphere
from tests.oracles import blender, closures
from tests.oracles.runners import opengl
from tests.targets.support import needs

MIXTURE = EXAMPLES["closures"]


def made(**changed):
    """No light comes back but of what is given: rows of one number each, or of all nodes."""
    values = {t.name: np.full((t.rows, t.nodes), max(t.low, 0.0)) for t in Closures.tables}
    for name, rows in changed.items():
        values[name] = np.broadcast_to(np.asarray(rows).reshape(len(rows), -1), values[name].shape)
    return Closures(**values)


def pairs(count=500):
    random = np.random.default_rng(1)
    return (hemisphere(random, count).astype(np.float64) for _ in range(2))


def test_without_bends_closures_are_ggx_over_lambert():
    wi, wo = pairs()
    mixture = made(diffuse=(0.2, 0.3, 0.4), color2=(1.0, 1.0, 1.0), roughness2=(0.6, 0.6))
    ggx = Ggx(diffuse=(0.2, 0.3, 0.4), specular=(1.0, 1.0, 1.0), roughness=0.6**2)
    np.testing.assert_allclose(mixture.eval(wi, wo), ggx.eval(wi, wo), rtol=1e-4)


def test_numbers_are_linear_in_the_facing_ratio():
    random = np.random.default_rng(2)
    wi, wo = pairs()
    rows = random.random((3, len(NODES)))
    expected = [np.interp(wo[:, 2], NODES, row) / math.pi for row in rows]
    np.testing.assert_allclose(made(diffuse=rows).eval(wi, wo), np.stack(expected, -1), rtol=1e-5)


def test_bent_closures_are_closures_of_another_normal():
    wi, wo = pairs()
    bend = 0.7
    mixture = made(color1=(1.0, 1.0, 1.0), roughness1=(0.5, 0.5), bend1=(bend,))
    normal = np.array([0.0, 0.0, 1.0]) + bend * wo
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    # Any frame of the bent normal will do: the facets are isotropic.
    tangent = np.cross(normal, (0.3, -0.8, 0.1))
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    frame = np.stack([tangent, np.cross(normal, tangent), normal], axis=1)
    light, view = (np.einsum("nij,nj->ni", frame, w) for w in (wi, wo))
    ggx = Ggx(diffuse=(0.0,) * 3, specular=(1.0,) * 3, roughness=0.25)
    expected = ggx.eval(light, view) * (light[:, 2] / wi[:, 2])[:, None]
    np.testing.assert_allclose(mixture.eval(wi, wo), expected, rtol=1e-4, atol=1e-9)


def test_materialx_shows_the_mixture():
    needs(opengl.missing())
    shown = render_sphere(MIXTURE, DirectionalLight())[0]
    assert closures.psnr(closures.materialx(MIXTURE), shown) > 50.0


def test_cycles_shows_the_mixture():
    needs(blender.missing())
    shader = TARGETS["osl-closures"]().files(MIXTURE, "mixture")["mixture.osl"].decode()
    museum = load_environment(require_data("environment", "museum.exr"))
    rendered = blender.closures(shader, SIZE, 1, museum.exposed())[0]
    shown = render_sphere(MIXTURE, DirectionalLight())[0]
    assert closures.psnr(rendered, shown) > 60.0


def test_steps_of_the_fit_follow_the_slope():
    problem = closure_fit._Problem(EXAMPLES["ggx"], 0, rough=True)
    random = np.random.default_rng(3)
    table = closure_fit._start((0.3, 0.5, 0.7))
    table += random.uniform(0.01, 0.1, table.shape)
    gradient = problem.equations(table)[0].reshape(table.shape)
    for _ in range(4):
        way = random.normal(size=table.shape)
        above, below = (problem.value(table + h * way) for h in (1e-6, -1e-6))
        assert (above - below) / 2e-6 == pytest.approx((gradient * way).sum(), rel=2e-2)


@pytest.fixture
def quick(monkeypatch):
    for name, value in {
        "_VIEWS": closure_fit._ROUGH_VIEWS,
        "_SIZE": closure_fit._ROUGH_SIZE,
        "_STARTS": closure_fit._STARTS[:1],
        "_FEW": 5,
        "_ALL": 25,
    }.items():
        monkeypatch.setattr(closure_fit, name, value)


def test_a_fit_shows_what_it_was_fitted_to(quick):
    values, facts = closure_fit.fit_closures(Closures, EXAMPLES["ggx"], 0, silent)
    assert facts["views_psnr"] > 38.0
    assert facts["directional_psnr"] > 38.0
    shown, truth = (
        render_sphere(brdf, DirectionalLight())[0] for brdf in (Closures(**values), EXAMPLES["ggx"])
    )
    assert closures.psnr(shown, truth) > 38.0


def test_a_fit_gains_no_energy(quick):
    values, facts = closure_fit.fit_closures(Closures, Lambert(diffuse=(1.0, 1.0, 1.0)), 0, silent)
    angles = np.stack([np.linspace(0.0, 1.5, 30), np.zeros(30)])
    assert albedos(Closures(**values), angles, 16).max() < 1.01
    assert facts["max_albedo"] < 1.0 + 1e-5
