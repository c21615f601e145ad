"""The haze of OpenPBR 1.2, as its study has it."""

from __future__ import annotations

import numpy as np
import pytest

from lab.studies.references.hazy_openpbr import HAZE, SPREAD, HazyOpenPbr, TwoLobeOpenPbr, wider
from nacre.geometry import join, uniform_hemisphere
from nacre.standard.openpbr import OpenPbr
from tests.analytic.materials import EXAMPLES
from tests.oracles.openpbr import BARE, Comparison
from tests.oracles.runners.materialx import OpenGl

VALUES = EXAMPLES["openpbr"].values
_U = np.random.default_rng(3).random((4, 500))
WI, WO = (join(uniform_hemisphere(*_U[k : k + 2])).astype(np.float32) for k in (0, 2))


def evaluated(model, **values):
    return model(**{**VALUES, **values}).eval(WI, WO)


def test_no_haze_is_the_present_model_to_the_bit():
    present = evaluated(OpenPbr)
    for spread in (0.0, 0.3, 1.0):
        hazy = evaluated(HazyOpenPbr, **{HAZE: 0.0, SPREAD: spread})
        assert hazy.tobytes() == present.tobytes()


def test_only_haze_is_the_present_model_with_its_roughness():
    roughness = wider(VALUES["specular_roughness"], 0.4)
    np.testing.assert_allclose(
        evaluated(HazyOpenPbr, **{HAZE: 1.0, SPREAD: 0.4}),
        evaluated(OpenPbr, specular_roughness=roughness),
        rtol=1e-5,
        atol=1e-7,
    )


@pytest.mark.parametrize("given", [{}, {**BARE, "base_metalness": 0.0}])
def test_the_mixture_is_what_materialx_evaluates(given):
    """Lobes are mixed in the graph, whole materials here."""
    if problem := OpenGl().missing():
        pytest.skip(f"needs {problem}")
    from lab.studies.references.hazy_graph import shader

    errors = Comparison(HazyOpenPbr, 5, shader).errors(given, materials=4, lights=3, points=200)
    assert len(errors) > 4000
    assert np.median(errors) < 1e-5
    assert errors.max() < 5e-3


@pytest.mark.parametrize("name", [HAZE, SPREAD])
def test_ranges_are_those_of_the_specification(name):
    values = {**VALUES, HAZE: 0.5, SPREAD: 0.3}
    for number in (0.0, 1.0):
        HazyOpenPbr(**{**values, name: number})
    for number in (-0.01, 1.01):
        with pytest.raises(ValueError, match=rf"{name} must lie in \[0, 1\]"):
            HazyOpenPbr(**{**values, name: number})


def test_two_lobes_contain_haze():
    values = {**VALUES, HAZE: 0.3, SPREAD: 0.6}
    two = TwoLobeOpenPbr(**TwoLobeOpenPbr.of_haze(values)).eval(WI, WO)
    np.testing.assert_allclose(two, HazyOpenPbr(**values).eval(WI, WO), rtol=1e-5, atol=1e-7)
