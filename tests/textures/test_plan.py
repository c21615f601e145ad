"""Directions to photograph."""

from __future__ import annotations

import numpy as np

from nacre.measured.textures import BONN
from nacre.measured.textures.direction_list import named_directions
from nacre.measured.textures.domes import below
from nacre.textures.plan import candidate_pairs, informative, write_plan
from tests.textures.codecs.basis.made import codec


def test_each_pair_lowers_most_what_is_unknown() -> None:
    """Against covariances that are inverted anew for every candidate."""
    made = codec()
    wi, wo = candidate_pairs(12)
    here, target = made.functions(wi, wo), made.functions(*BONN.pairs())
    variances = made.prior.deviations**2
    luma_count = made.functions.luma_count

    def unknown(chosen: list[int]) -> float:
        total = 0.0
        for functions, aim, variance, times in (
            (here.luma, target.luma, variances[:luma_count], 1),
            (
                here.chroma,
                target.chroma,
                variances[luma_count : luma_count + made.functions.chroma_count],
                2,
            ),
        ):
            seen = functions[chosen].astype(float)
            inverse = np.diag(1.0 / variance) + seen.T @ seen / made.prior.noise
            total += times * np.trace(np.linalg.inv(inverse) @ (aim.T @ aim))
        return total

    expected: list[int] = []
    for _ in range(5):
        others = [k for k in range(12) if k not in expected]
        expected.append(min(others, key=lambda k: unknown([*expected, k])))
    assert informative(made, wi, wo, 5).tolist() == expected
    assert sorted(informative(made, wi, wo, 12)) == list(range(12))


def test_candidates_keep_within_limits() -> None:
    wi, wo = candidate_pairs(200, lights=40.0, views=60.0, seed=1)
    assert below(wi, 40.0).all()
    assert below(wo, 60.0).all()
    assert not below(wo, 55.0).all()
    mean = wi.mean(0)
    np.testing.assert_allclose(mean, [0.0, 0.0, 0.5 * (1.0 + np.cos(np.radians(40.0)))], atol=0.03)
    again = candidate_pairs(200, lights=40.0, views=60.0, seed=1)
    assert np.array_equal(again[0], wi)
    wi, wo = candidate_pairs(100, lights=70.0, views=30.0, flash=True)
    assert np.array_equal(wi, wo)
    assert below(wo, 30.0).all()


def test_a_plan_is_a_list_of_directions(tmp_path) -> None:
    wi, wo = candidate_pairs(20)
    write_plan(wi, wo, tmp_path / "plan.csv")
    found = named_directions(str(tmp_path / "plan.csv"))
    np.testing.assert_allclose(found[0], wi, atol=2e-4)
    np.testing.assert_allclose(found[1], wo, atol=2e-4)
