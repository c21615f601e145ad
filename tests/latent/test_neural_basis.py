"""Neural bases: what codes mean, and how they are found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nacre.analytic import Ggx
from nacre.array import Array, Components
from nacre.errors import FormatError, NacreError
from nacre.latent import NeuralBasis, NeuralBasisBrdf
from nacre.latent.directions import isotropic_inputs, shared_directions
from nacre.measured import MerlBrdf
from nacre.neural.inputs import ENHANCED
from nacre.numerics.channels import PERMUTATIONS
from tests.latent.made import GRID, predictor, random_basis
from tests.reflectances import Brushed

CODE = np.array([0.9, -1.3, 0.4, 0.2, 1.1, -0.7])
WI, WO = shared_directions(3000, 11)


def test_a_code_weighs_functions():
    made = random_basis()
    functions = made.values(isotropic_inputs(WI, WO, ENHANCED))
    luma = functions[:, 0] + functions[:, 1:5] @ CODE[:4]
    chroma = CODE[4] * np.array([1, -1, 0]) / 2**0.5 + CODE[5] * np.array([1, 1, -2]) / 6**0.5
    expected = np.exp(luma[:, None] + functions[:, 5:] * chroma)
    np.testing.assert_allclose(made.decode(CODE).eval(WI, WO), expected, rtol=1e-4)


def test_directions_are_above_the_horizon_and_the_same_for_a_seed():
    for w in (WI, WO):
        assert w.shape == (3000, 3)
        assert (w[:, 2] > 0.0).all()
        np.testing.assert_allclose(np.linalg.norm(w, axis=1), 1.0, atol=1e-5)
    np.testing.assert_array_equal(shared_directions(3000, 11)[0], WI)
    assert not np.array_equal(shared_directions(3000, 12)[0], WI)
    # Highlights and the whole sky are both there.
    cosine = ((WI + WO) / np.linalg.norm(WI + WO, axis=1, keepdims=True))[:, 2]
    assert (cosine > np.cos(0.03)).mean() > 0.05
    assert (cosine < np.cos(0.6)).mean() > 0.2


def test_the_code_of_what_the_basis_knows_is_found():
    made = random_basis()
    truth = made.decode(CODE)
    found = made.encode(truth)
    np.testing.assert_allclose(found, CODE, atol=0.02)
    np.testing.assert_array_equal(found, made.encode(truth))


@pytest.mark.parametrize("index", range(6))
def test_channels_that_change_places_change_the_code_alike(index):
    made = random_basis()
    (code,) = made.permuted(CODE[None], index)
    one, other = (made.decode(c).eval(WI, WO) for c in (CODE, code))
    np.testing.assert_allclose(one[:, PERMUTATIONS[index]], other, rtol=1e-4)


class Partly(NeuralBasisBrdf):
    """Known where the light comes from one side; a hundred times too bright elsewhere."""

    def eval_components(self, wi: Components, wo: Components) -> Components:
        known = self.valid_components(wi, wo)
        red, green, blue = (np.where(known, c, 100.0 * c) for c in super().eval_components(wi, wo))
        return red, green, blue

    def valid_components(self, wi: Components, wo: Components) -> Array:
        return wi[0] > 0.0


def test_what_is_not_known_does_not_count():
    made = random_basis()
    np.testing.assert_allclose(made.encode(Partly(made, CODE)), CODE, atol=0.05)
    nowhere = MerlBrdf(np.full((3, *GRID.dimensions), -1.0))
    with pytest.raises(NacreError, match="known at none"):
        made.encode(nowhere)
    with pytest.raises(FormatError, match="anisotropic"):
        made.encode(Brushed())


def test_a_material_far_from_the_basis_has_a_bounded_code():
    made = random_basis()
    white = Ggx(diffuse=(1.0,) * 3, specular=(1.0,) * 3, roughness=0.05)
    code = made.encode(white)
    assert np.isfinite(code).all()
    assert np.abs(code).max() <= 100.0


def test_any_code_gives_finite_reflectance():
    made = random_basis()
    for code in (np.zeros(6), np.full(6, 9e5), np.full(6, -9e5), np.eye(6)[0] * 50):
        f = made.decode(code).eval(WI, WO)
        assert np.isfinite(f).all()
        assert (f >= 0).all()
        assert f.max() <= 1.1e6
    for wrong in (np.zeros(5), np.full(6, np.nan), np.full(6, 1e6), np.zeros((6, 1))):
        with pytest.raises(ValueError, match="6 values"):
            made.decode(wrong)


def test_sizes_are_stated():
    made, facts = random_basis(), random_basis().decode(CODE).describe()
    assert (facts["code dim"], facts["code bytes"], facts["memory bytes"]) == (6, 24, 24)
    numbers = 6 * 12 + 12 + 12 * 10 + 10 + 11 * 6 + 5 * 6
    assert facts["basis bytes"] == made.nbytes == 4 * numbers
    predicting = replace(made, predictors={"ggx": predictor("ggx")})
    assert predicting.nbytes == 4 * (numbers + 6 * 8 + 8 + 8 * 2 + 2)


def test_what_is_no_basis_is_refused():
    made = random_basis()
    for hidden, functions, luma in (
        (made.hidden[::-1], made.functions, 4),
        (made.hidden, made.functions[:-1], 4),
        (made.hidden, made.functions, 6),
        (made.hidden, made.functions[:, :1], 0),
        (made.hidden, made.functions[:, :-1], 4),
    ):
        with pytest.raises(ValueError, match=r"chain|follow|inputs|luma|no codes"):
            NeuralBasis(hidden, functions, luma, made.examples)
