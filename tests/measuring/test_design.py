"""Plans against linear regression done by hand, and against chance."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.color import GAMMA
from nacre.errors import NacreError
from nacre.latent.directions import shared_directions
from nacre.latent.hypernetwork import neural_basis
from nacre.latent.neural_basis import decoded
from nacre.latent.posterior import DARK
from nacre.measuring import Design, Exposures, Instrument, propose
from nacre.measuring import design as module
from nacre.numerics.direction_samples import DirectionSamples
from nacre.sampling.lit_views import lit_views
from tests.latent.made import basis, random_basis

WI, WO = (w[:, None] for w in shared_directions(60, 5))
EXPOSURES = Exposures(WI, WO)


def by_hand(made, codes, taken, lit=None):
    """The mean variance of what views show, by the formula of Bayesian linear regression."""
    wi, wo = WI[taken, 0], WO[taken, 0]
    inputs = module.isotropic_inputs(wi, wo, module.ENHANCED).astype(float)
    apart = ((inputs[:, None] - inputs) ** 2).sum(-1)
    alike = module.ALIKE**2 * np.exp(-0.5 * apart / module.REACH**2)
    noise = np.kron(alike + module.NOISE**2 * np.eye(len(taken)), np.eye(3))
    lit = lit or lit_views(1, module.VIEWS)
    views = lit.wi.reshape(-1, 3), lit.wo.reshape(-1, 3)
    found = []
    for code in codes:

        def logarithm(z):
            scaled = decoded(*made.logarithms(wi, wo), z) * wi[:, 2:]
            return np.log(scaled + DARK).reshape(-1)

        def shown(z):
            f_r = decoded(*made.logarithms(*views), z).reshape(*lit.wi.shape)
            return ((lit.radiance(f_r) + 1e-4) ** (1.0 / GAMMA)).reshape(-1)

        def slopes(function, z):
            steps = 1e-3 * np.eye(len(z))
            return np.array([(function(z + s) - function(z - s)) / 2e-3 for s in steps])

        rows, seen = slopes(logarithm, code), slopes(shown, code)
        prior = np.eye(len(code)) / module.UNKNOWN**2
        covariance = np.linalg.inv(prior + rows @ np.linalg.solve(noise, rows.T))
        found.append(np.einsum("iv,ij,jv->v", seen, covariance, seen).mean())
    return np.mean(found)


def test_what_is_left_is_that_of_a_regression():
    made = random_basis()
    codes = made.examples[:2].astype(float)
    design = Design(made, codes, EXPOSURES)
    for count in range(1, 4):
        design.choose()
        assert len(design.chosen) == count
        assert design.left() == pytest.approx(by_hand(made, codes, design.chosen), rel=0.02)


def test_pictures_may_be_others():
    made, lit = random_basis(), lit_views(7, 6)
    codes = made.examples[:2].astype(float)
    design = Design(made, codes, EXPOSURES, lit=lit)
    design.choose()
    assert design.left() == pytest.approx(by_hand(made, codes, design.chosen, lit), rel=0.02)


def test_the_pair_that_tells_most_is_taken():
    made = random_basis()
    codes = made.examples[:2].astype(float)
    first = Design(made, codes, EXPOSURES).choose()
    left = [by_hand(made, codes, [k]) for k in range(len(WI))]
    assert left[first] <= 1.01 * min(left)


def test_known_pairs_count_like_chosen_ones():
    made = random_basis()
    codes = made.examples.astype(float)
    one = Design(made, codes, EXPOSURES)
    first, second = one.choose(), one.choose()
    other = Design(made, codes, EXPOSURES, (WI[first], WO[first]))
    assert other.choose() == second
    assert other.left() == pytest.approx(one.left(), rel=1e-4)


def test_pictures_tell_more_than_their_middles():
    made = random_basis()
    left = []
    for instrument in (
        Instrument(fixed_light=30.0),
        Instrument(fixed_light=30.0, field=(20.0, 20.0)),
    ):
        design = Design(made, made.examples, instrument.exposures())
        design.choose()
        left.append(design.left())
    assert left[1] < left[0]


def test_no_pair_is_taken_twice():
    made = random_basis()
    design = Design(made, made.examples, Exposures(WI[:5], WO[:5]))
    assert sorted(design.choose() for _ in range(5)) == list(range(5))
    with pytest.raises(ValueError, match="no exposure is left"):
        design.choose()


def test_plans_are_for_neural_bases():
    assert neural_basis(random_basis()) is random_basis()
    with pytest.raises(NacreError, match="neural basis; this one is 'pca'"):
        neural_basis(basis())


def test_the_next_pairs_after_some():
    made = random_basis()
    truth = made.decode(made.examples[1] + 0.3)
    wi, wo = WI[:6, 0], WO[:6, 0]
    samples = DirectionSamples(wi, wo, truth.eval(wi, wo))
    found = propose(made, made.posterior(samples), samples, Instrument(), 5)
    assert found.wi.shape == found.low.shape == (5, 3)
    assert len(found.errors) == 6
    assert (np.diff(found.errors) < 0.0).all()
    assert ((found.low < found.expected) & (found.expected < found.high)).all()
    inside = truth.eval(found.wi, found.wo)
    assert ((inside > found.low) & (inside < found.high)).mean() > 0.5
    assert len(propose(made, made.posterior(samples), samples, Instrument(), 5, until=1.0).wi) == 0


def test_after_many_another_no_longer_pays():
    made = random_basis()
    truth = made.decode(made.examples[1] + 0.3)
    wi, wo = shared_directions(800, 8)
    few = DirectionSamples(wi[:2], wo[:2], truth.eval(wi[:2], wo[:2]))
    many = DirectionSamples(wi, wo, truth.eval(wi, wo))
    pays = [propose(made, made.posterior(s), s, Instrument(), 1).pays for s in (few, many)]
    assert pays == [True, False]
