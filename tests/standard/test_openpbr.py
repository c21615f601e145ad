"""OpenPBR's formula, against the GLSL that MaterialX generates of the file that is written."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.standard.openpbr import AnisotropicOpenPbr, OpenPbr
from nacre.targets.program import Function
from tests.analytic.materials import EXAMPLES
from tests.oracles import openpbr
from tests.oracles.runners import opengl
from tests.oracles.runners.materialx import OpenGl
from tests.tiers import tiered


@pytest.mark.parametrize("model", tiered([OpenPbr, AnisotropicOpenPbr], [AnisotropicOpenPbr]))
def test_the_formula_is_what_materialx_evaluates(model):
    if problem := OpenGl().missing():
        pytest.skip(f"needs {problem}")
    errors = openpbr.Comparison(model, 5).errors({}, materials=8, lights=3, points=200)
    assert len(errors) > 8000
    assert np.median(errors) < 1e-5
    assert errors.max() < 5e-3  # narrow lobes, by the half vectors of single precision


def test_a_film_without_thickness_is_none():
    values = {**EXAMPLES["openpbr"].values, "thin_film_thickness": 0.0}
    wi, wo = np.random.default_rng(3).random((2, 100, 3)) + 0.05
    wi, wo = (w / np.linalg.norm(w, axis=-1, keepdims=True) for w in (wi, wo))
    bare = OpenPbr(**values | {"thin_film_weight": 0.0}).eval(wi, wo)
    np.testing.assert_array_equal(OpenPbr(**values).eval(wi, wo), bare)


def test_layers_that_are_absent_cost_nothing():
    sizes = []
    for weight in (0.5, 0.0):
        layers = dict.fromkeys(("coat_weight", "fuzz_weight", "thin_film_weight"), weight)
        brdf = OpenPbr(**EXAMPLES["openpbr"].values | layers)
        formula = Function.of("eval", brdf.eval_components, {"wi": 3, "wo": 3}, "rgb")
        sizes.append(len(formula.operations))
    assert sizes[0] < 2000
    assert sizes[1] < sizes[0] / 2


@pytest.mark.parametrize("metal", [0.0, 1.0])
def test_a_white_surface_keeps_the_energy(metal):
    """The albedo of a rough surface that absorbs nothing is about 1, by a fit of few percent."""
    white = (1.0, 1.0, 1.0)
    values = {**EXAMPLES["openpbr"].values, "base_metalness": metal, "base_weight": 1.0}
    values |= {"base_color": white, "specular_color": white, "specular_weight": 1.0}
    values |= dict.fromkeys(("coat_weight", "fuzz_weight", "thin_film_weight"), 0.0)
    u, v = np.random.default_rng(1).random((2, 40000))
    radius, phi = np.sqrt(u), 2.0 * np.pi * v
    wi = np.stack([radius * np.cos(phi), radius * np.sin(phi), np.sqrt(1.0 - u)], axis=1)
    for cosine in (0.9, 0.5):
        wo = np.array([[np.sqrt(1.0 - cosine * cosine), 0.0, cosine]])
        albedo = np.pi * OpenPbr(**values).eval(wi, wo).mean(axis=0)
        np.testing.assert_allclose(albedo, 1.0, atol=0.05)


def test_the_shader_says_what_is_wrong_with_a_document():
    if problem := OpenGl().missing() or opengl.missing():
        pytest.skip(f"needs {problem}")
    text = '<materialx version="1.39"><open_pbr_surface name="a" type="float"/></materialx>'
    with pytest.raises(RuntimeError, match="a"):
        openpbr.SurfaceShader(text)
