"""Second moments: their weights one by one, and that proposals integrate over the hemisphere."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nacre.brdf import Brdf
from nacre.sampling.moment import Proposal, propose, second_moment
from tests.mitsuba.reflectances import Constant


def test_weights_are_squares_relative_to_albedos_of_channels() -> None:
    proposal = Proposal(
        wo=np.array([[[0.0, 0.0, 1.0]] * 2]),
        wi=np.array([[[0.6, 0.0, 0.8], [0.0, 0.8, 0.6]]]),
        density=np.array([[0.5, 0.25]]),
        fractions=np.array([1.0]),
    )
    f_r = np.array([[[1.0, 0.02, 0.0], [0.5, 0.02, 0.0]]])
    expected = np.zeros(2)
    for channel in range(3):
        value = f_r[0, :, channel] * [0.8, 0.6]
        albedo = (value[0] / 0.5 + value[1] / 0.25) / 2
        brightest = (0.8 / 0.5 + 0.3 / 0.25) / 2
        scale = albedo**2 + (0.1 * brightest) ** 2  # noise of dark channels counts less
        expected += value**2 / scale / 3 / np.array([0.5, 0.25]) / 2
    np.testing.assert_allclose(proposal.weights(f_r)[0], expected, rtol=1e-12)
    np.testing.assert_allclose(proposal.single().weights(f_r)[0], expected, rtol=1e-6)


def test_wild_values_weigh_nothing() -> None:
    proposal = propose(1, 16)
    f_r = np.ones((*proposal.density.shape, 3))
    f_r[0, 0], f_r[1, 1, 2] = np.inf, np.nan
    weights = proposal.weights(f_r)
    assert np.isfinite(weights).all()
    assert weights[0, 0] == 0.0
    assert not weights[np.isinf(proposal.density)].any()


def test_lights_of_a_proposal_integrate_over_the_hemisphere() -> None:
    proposal = propose(2, 4096)
    above = np.isfinite(proposal.density)
    solid = np.where(above, 1.0 / proposal.density, 0.0).mean(axis=1)
    np.testing.assert_allclose(solid, 2.0 * math.pi, rtol=0.03)
    flux = (proposal.wi[..., 2] / proposal.density).mean(axis=1)
    np.testing.assert_allclose(flux, math.pi, rtol=0.03)
    np.testing.assert_array_equal(
        proposal.wi[~above], np.tile([0.0, 0.0, 1.0], ((~above).sum(), 1))
    )
    assert proposal.fractions.sum() == pytest.approx(1.0)
    # Views as an orthographic picture of a sphere has them: the mean of sin^2 is 1/2, of cos 2/3.
    z = proposal.wo[:, 0, 2]
    assert proposal.fractions @ (1.0 - z * z) == pytest.approx(0.5)
    assert proposal.fractions @ z == pytest.approx(2.0 / 3.0, abs=1e-3)


@pytest.mark.parametrize("brdf", [Constant(0.8, 0.8, 0.8), Constant(0.1, 0.1, 0.1)])
def test_the_moment_of_a_diffuse_material_and_cosine_lobe_is_about_1(brdf: Brdf) -> None:
    moment = second_moment(brdf)
    found = (moment.weights / (moment.wi[..., 2] / math.pi)).sum()
    # The scale has a hundredth of the squared albedo added.
    assert found == pytest.approx(1.0 / 1.01, rel=0.03)
