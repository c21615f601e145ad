"""What every sampler keeps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from nacre.analytic.lambert import Lambert
from nacre.brdf import Brdf, Sampler
from nacre.sampling import SAMPLERS, describe_sampler, make_sampler
from nacre.soundness.cells import count_cells, quadrature
from nacre.testing.cases import Checks, Contracts, maker, pairs, relative_error
from nacre.testing.extremes import extreme_directions, extreme_numbers, views

CONTRACTS = Contracts()
_COUNT = 30_000
_WHITE = Lambert(diffuse=(1.0, 1.0, 1.0))


def check_sampler(sampler: Sampler | Callable[[], Sampler]) -> Checks:
    """Contracts of a sampler: its density is exact, for what it draws and for anything else.

    Parameters
    ----------
    sampler
        A sampler, or a function that makes it. One of a registered kind is also described and made
        again.
    """
    return CONTRACTS.of(maker(sampler, Sampler))


def _sampled(sampler: Sampler) -> Brdf:
    """A material that is sampled so."""
    return _WHITE.replaced(sampler=sampler)


@CONTRACTS.add
def _samples_have_the_density_that_is_said(sampler: Sampler) -> None:
    brdf = _sampled(sampler)
    u = np.random.default_rng(1).random((_COUNT, 3), np.float32)
    for wo in views(4):
        wi, density = brdf.sample(wo, u)
        drawn = density > 0.0
        assert (wi[:, 2] > 0.0)[drawn].all()
        p = count_cells(brdf.pdf, wo, wi[drawn], _COUNT).p_value()
        assert p > 1e-6, f"p = {p:.2g} in a chi-square test"
        again = brdf.pdf(wi[drawn], wo)
        assert np.quantile(np.abs(again / density[drawn] - 1.0), 0.99) < 0.02


@CONTRACTS.add
def _the_density_integrates_to_at_most_one(sampler: Sampler) -> None:
    brdf = _sampled(sampler)
    for wo in views(4):
        points = quadrature(wo)
        whole = float((brdf.pdf(points.wi, wo.astype(float)) * points.solid_angle).sum())
        assert whole < 1.02, f"the density integrates to {whole:.3g}"


@CONTRACTS.add
def _extremes_give_numbers(sampler: Sampler) -> None:
    brdf = _sampled(sampler)
    for kind in (np.float32, np.float64):
        w: Any = extreme_directions().astype(kind)
        u = extreme_numbers().astype(kind)
        density = brdf.pdf(w[:, None], w)
        assert np.isfinite(density).all()
        assert (density >= 0.0).all()
        assert (density[w[:, 2] <= 0.0] == 0.0).all()
        assert (density[:, w[:, 2] <= 0.0] == 0.0).all()
        with np.errstate(all="ignore"):
            wi, density = brdf.sample(w[:, None], u)
        assert np.isfinite(density).all()
        assert (density >= 0.0).all()
        assert np.isfinite(wi[density > 0.0]).all()
        np.testing.assert_allclose(np.linalg.norm(wi[density > 0.0], axis=-1), 1.0, atol=2e-4)
        assert (density[wi[..., 2] <= 0.0] == 0.0).all()
        assert (density[w[:, 2] <= 0.0] == 0.0).all()


@CONTRACTS.add
def _single_precision_is_enough(sampler: Sampler) -> None:
    brdf = _sampled(sampler)
    wi, wo = pairs(2000)
    single, double = brdf.pdf(wi, wo), brdf.pdf(wi.astype(np.float64), wo)
    assert double.dtype == np.float64
    assert np.quantile(relative_error(single, double), 0.999) < 2e-3


@CONTRACTS.add
def _what_files_hold_makes_it_again(sampler: Sampler) -> None:
    if SAMPLERS.get(sampler.kind) is type(sampler):
        assert make_sampler(describe_sampler(sampler)) == sampler
