"""Families of samplers: parameters may be anything, densities are those of the samplers."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.geometry import split
from nacre.sampling import BlinnPhongMixture, GgxMixture
from nacre.sampling.moment import Pairs, propose, view_pairs
from nacre.sampling.parametrizations import PARAMETRIZATIONS

PROPOSAL = propose(3, 64)
PAIRS = view_pairs(PROPOSAL.wo, PROPOSAL.wi)


@pytest.mark.parametrize("name", PARAMETRIZATIONS)
def test_densities_are_those_of_the_samplers(name: str) -> None:
    family = PARAMETRIZATIONS[name]
    free = np.random.default_rng(1).normal(0.0, 1.5, (6, family.size))
    densities = family.density(free, PAIRS)
    assert densities.shape == (6, *PROPOSAL.density.shape)
    for parameters, density in zip(free, densities, strict=True):
        sampler = family.sampler(parameters)
        expected = sampler.pdf_components(split(PROPOSAL.wi), split(PROPOSAL.wo))
        np.testing.assert_allclose(density, expected, rtol=0.02, atol=1e-4)
        assert np.median(np.abs(density / expected - 1.0)) < 1e-3  # four digits are kept


@pytest.mark.parametrize("name", PARAMETRIZATIONS)
def test_torch_gives_the_same_densities_with_slopes(name: str) -> None:
    torch = pytest.importorskip("torch", reason="needs the extra 'latent'")
    family = PARAMETRIZATIONS[name]
    free = np.random.default_rng(2).normal(0.0, 1.5, (3, family.size))

    def tensor(values):
        return torch.from_numpy(np.array(np.broadcast_to(values, PROPOSAL.density.shape)))

    half, view = (tuple(map(tensor, w)) for w in PAIRS[:2])
    given = torch.from_numpy(free).requires_grad_()
    density = family.density(given, Pairs(half, view, tensor(PAIRS.cosine)))
    np.testing.assert_allclose(density.detach(), family.density(free, PAIRS), rtol=1e-9)
    density.log().sum().backward()
    slopes = given.grad.numpy()
    assert np.isfinite(slopes).all()
    for column in range(family.size):
        step = 1e-6 * np.eye(family.size)[column]
        ends = [np.log(family.density(free + s * step, PAIRS)) for s in (1.0, -1.0)]
        difference = (ends[0] - ends[1]).sum(axis=(1, 2)) / 2e-6
        np.testing.assert_allclose(slopes[:, column], difference, rtol=1e-3, atol=1e-3)


@pytest.mark.parametrize("name", PARAMETRIZATIONS)
def test_whatever_the_parameters_samplers_are_within_bounds(name: str) -> None:
    family = PARAMETRIZATIONS[name]
    signs = np.random.default_rng(3).choice([-1.0, 1.0], (20, family.size))
    for scale in (0.0, 10.0, 1e3, 1e30):
        for free in scale * signs:
            sampler = family.sampler(free)  # which raises for what is out of bounds
            assert isinstance(sampler, (BlinnPhongMixture, GgxMixture))
            density = sampler.pdf_components(split(PROPOSAL.wi), split(PROPOSAL.wo))
            above = np.isfinite(PROPOSAL.density)
            assert np.isfinite(density).all()
            cosine = PROPOSAL.wi[..., 2] / np.pi
            assert (density >= 0.0099 * cosine)[above].all()  # so weights are bounded


@pytest.mark.parametrize("name", ["blinn-phong", "ggx"])
def test_labels_are_the_logistic_of_what_a_sampler_comes_from(name: str) -> None:
    family = PARAMETRIZATIONS[name]
    for free in np.random.default_rng(4).normal(0.0, 1.0, (6, family.size)):
        places = family.places(family.sampler(free))
        np.testing.assert_allclose(places, 1.0 / (1.0 + np.exp(-free)), atol=2e-4)


def test_lobes_of_another_kind_are_no_labels() -> None:
    blinn_phong, ggx, mixture = (
        PARAMETRIZATIONS[name].sampler(np.zeros(PARAMETRIZATIONS[name].size))
        for name in ("blinn-phong", "ggx", "mixture")
    )
    for name, sampler in (
        *(("blinn-phong", ggx), ("ggx", blinn_phong), ("ggx", mixture)),
        *(("mixture", blinn_phong), ("mixture", mixture)),
    ):
        with pytest.raises(
            ValueError, match=f"lobes of type {type(sampler).__name__} cannot be labels"
        ):
            PARAMETRIZATIONS[name].places(sampler)


def test_sizes_are_what_the_parameters_of_the_samplers_need() -> None:
    # A mixture has a fraction and a diffuse one, then share, two roughnesses, shift of two lobes.
    sizes = {name: family.size for name, family in PARAMETRIZATIONS.items()}
    assert sizes == {"blinn-phong": 2, "ggx": 2, "mixture": 3 * (2 + 2 * 4)}
