"""What every sampler promises: an exact density, of what it draws and of anything else."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nacre.analytic.lambert import Lambert
from nacre.brdf import Brdf, CosineSampler, Sampler
from nacre.geometry import split
from nacre.sampling import SAMPLERS as REGISTERED
from nacre.sampling import BlinnPhongMixture, GgxLobe, GgxMixture, UniformSampler
from nacre.sampling.tilted import TiltedMixture
from nacre.sampling.visible_normals import MIN_ROUGHNESS
from nacre.soundness.cells import count_cells, quadrature
from nacre.testing.sampler import CONTRACTS
from tests.contracts.classes import concrete
from tests.contracts.directions import extreme_directions, pairs, views
from tests.contracts.samplers import SAMPLERS
from tests.measured.support import relative_error
from tests.tiers import tiered
from tests.variants import require_mitsuba

COUNT = 30_000
WHITE = Lambert(diffuse=(1.0, 1.0, 1.0))


def sampled(sampler: Sampler) -> Brdf:
    """A material that is sampled so."""
    return WHITE.replaced(sampler=sampler)


def p_value(brdf: Brdf, wo: np.ndarray, wi: np.ndarray, count: int) -> float:
    """Of samples above the horizon that are left of `count` drawn; see `nacre.soundness`."""
    return count_cells(brdf.pdf, wo, wi, count).p_value()


def integral(brdf: Brdf, wo: np.ndarray) -> float:
    """Of the density of a material's samples over the hemisphere."""
    points = quadrature(wo)
    return float((brdf.pdf(points.wi, wo.astype(float)) * points.solid_angle).sum())


@pytest.fixture(scope="module", params=tiered(SAMPLERS, list(SAMPLERS)[::2]))
def brdf(request: pytest.FixtureRequest) -> Brdf:
    return sampled(SAMPLERS[request.param]())


def test_every_kind_is_here() -> None:
    kinds = {type(make()) for make in SAMPLERS.values()}
    assert concrete(Sampler) <= kinds
    assert {kind for _, kind in REGISTERED.members()} <= kinds


@pytest.mark.parametrize("contract", CONTRACTS)
def test_contracts_of_samplers(brdf: Brdf, contract: str) -> None:
    CONTRACTS[contract](brdf.sampler)


def test_the_test_notices_a_wrong_density() -> None:
    class Wrong(BlinnPhongMixture):
        def pdf_components(self, wi, wo):
            return super().pdf_components(wi, wo) * (1.0 + 0.2 * wi[0])

    u = np.random.default_rng(1).random((COUNT, 3), np.float32)
    wo = views(4)[1]
    for exponent in (5.0, 5000.0):
        right, wrong = (sampled(kind(0.5, exponent)) for kind in (BlinnPhongMixture, Wrong))
        wi, density = right.sample(wo, u)
        drawn = wi[density > 0.0]
        assert p_value(right, wo, drawn, COUNT) > 1e-6
        assert p_value(wrong, wo, drawn, COUNT) < 1e-6


@pytest.mark.parametrize("kind", [CosineSampler, UniformSampler])
def test_what_is_never_below_the_horizon_integrates_to_one(kind: type[Sampler]) -> None:
    for wo in views(4):
        assert integral(sampled(kind()), wo) == pytest.approx(1.0, abs=1e-3)


def test_drjit_samples_as_numpy_does(brdf: Brdf) -> None:
    mi = require_mitsuba()
    import drjit as dr

    sampler, (wi, wo) = brdf.sampler, pairs(2000)
    u = np.random.default_rng(3).random((2000, 3), np.float32)
    traced = [tuple(mi.Float(np.ascontiguousarray(c)) for c in w.T) for w in (wi, wo, u)]
    if isinstance(sampler, TiltedMixture):  # whose parameters are arrays of the library itself
        x, y = map(mi.Float, sampler.slope)
        sampler = TiltedMixture(mi.Float(sampler.fraction), mi.Float(sampler.roughness), (x, y))
    pdf = sampler.pdf_components(traced[0], traced[1])
    drawn, density = sampler.sample_components(traced[1], traced[2])
    dr.eval(pdf, *drawn, density)  # as one kernel
    assert np.quantile(relative_error(brdf.pdf(wi, wo), np.array(pdf)), 0.999) < 2e-3
    ours, expected = brdf.sample(wo, u)
    distance = np.abs(np.stack([np.array(c) for c in drawn], -1) - ours).max(-1)
    assert np.quantile(distance, 0.999) < 1e-3
    close = (distance < 1e-4) & (ours[:, 2] > 1e-3)
    assert np.quantile(relative_error(expected, np.array(density))[close], 0.99) < 2e-3


# Any parameters


@st.composite
def _mixtures(draw: st.DrawFn) -> GgxMixture:
    cosines = draw(st.sampled_from([(1.0,), (0.2, 0.9), (0.1, 0.45, 1.0)]))

    def values(low: float, high: float) -> tuple[float, ...]:
        return tuple(draw(st.floats(low, high)) for _ in cosines)

    count = draw(st.integers(1, 3))
    lobes = []
    for _ in range(count):
        # Of up to eight times as rough one way as across it: narrower lines lie between the
        # points of the quadrature.
        along = tuple(MIN_ROUGHNESS * 4000.0**x for x in values(0.0, 1.0))
        ratios = tuple(8.0**x for x in values(-1.0, 1.0))
        across = tuple(
            min(max(a * r, MIN_ROUGHNESS), 4.0) for a, r in zip(along, ratios, strict=True)
        )
        share = values(0.0, 0.9 / count)
        lobes.append(GgxLobe(share, along, across, values(-2.0, 2.0)))
    angle = draw(st.none() | st.floats(-math.pi, math.pi))
    return GgxMixture(tuple(lobes), values(0.0, 0.05), values(0.0, 0.05), cosines, angle)


ANY = st.one_of(
    _mixtures(),
    st.builds(BlinnPhongMixture, st.floats(0.0, 1.0), st.floats(0.0, 5.0).map(lambda x: 10.0**x)),
    st.builds(
        TiltedMixture,
        st.floats(0.0, 0.99),
        st.floats(0.02, 1.0),
        st.tuples(st.floats(-0.45, 0.45), st.floats(-0.45, 0.45)),
    ),
)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(ANY, st.floats(0.0, 85.0))
def test_whatever_the_parameters_the_density_is_that_of_samples(
    sampler: Sampler, degrees: float
) -> None:
    brdf, theta = sampled(sampler), math.radians(degrees)
    wo = np.float32([math.sin(theta) * 0.6, math.sin(theta) * 0.8, math.cos(theta)])
    wi, density = brdf.sample(wo, np.random.default_rng(5).random((8000, 3), np.float32))
    drawn = density > 0.0
    assert p_value(brdf, wo, wi[drawn], 8000) > 1e-6
    w = extreme_directions().astype(np.float32)
    assert np.isfinite(brdf.pdf(w[:, None], w)).all()


BOUNDED = [name for name in SAMPLERS if name.startswith(("lobes of", "predicted"))]


@pytest.mark.parametrize("name", BOUNDED)
def test_fitted_and_predicted_lobes_bound_every_weight(name: str) -> None:
    """By a cosine lobe of one percent."""
    sampler, (wi, wo) = SAMPLERS[name](), pairs()
    density = sampler.pdf_components(split(wi.astype(np.float64)), split(wo.astype(np.float64)))
    assert (density >= 0.0099 * wi[:, 2] / math.pi).all()
