"""Mixtures of diffuse and GGX lobes: what is drawn is what the density says."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from nacre.array import Components
from nacre.geometry import rotate, split
from nacre.sampling import GgxLobe, GgxMixture
from nacre.sampling.visible_normals import distribution, visible_density

from .mixtures import MIXTURES, steady

COUNT = 100_000


def view(degrees: float, turned: float = 0.6) -> Components:
    theta = math.radians(degrees)
    wo = rotate((math.sin(theta), 0.0, math.cos(theta)), turned)
    return split(np.tile(wo, (COUNT, 1)))


def test_a_lobe_alone_is_ggx() -> None:
    random = np.random.default_rng(1)
    h, wo = random.normal(size=(2, 1000, 3))
    for w in (h, wo):
        w[:, 2] = np.abs(w[:, 2])
        w /= np.linalg.norm(w, axis=1, keepdims=True)
    alpha, cosine = 0.3, wo[:, 2]
    tan2 = (1.0 - h[:, 2] ** 2) / h[:, 2] ** 2
    d = alpha**2 / (math.pi * h[:, 2] ** 4 * (alpha**2 + tan2) ** 2)
    np.testing.assert_allclose(distribution(split(h), (alpha, alpha)), d, rtol=1e-9)
    g1 = 2.0 / (1.0 + np.sqrt(1.0 + alpha**2 * (1.0 - cosine**2) / cosine**2))
    found = visible_density(split(h), split(wo), (alpha, alpha))
    np.testing.assert_allclose(found, g1 * d / (4.0 * cosine), rtol=1e-9)


@pytest.mark.parametrize("name", MIXTURES)
def test_opposite_directions_at_the_horizon_have_a_density(name: str) -> None:
    wi = np.float32([[1.0, 0.0, 1e-38], [0.8, -0.6, 1e-45]])
    density = MIXTURES[name].pdf_components(split(wi), split(wi * np.float32([-1.0, -1.0, 1.0])))
    assert np.isfinite(density).all()
    assert (density >= 0.0).all()


def test_a_shift_moves_the_mean_slope() -> None:
    slopes = np.linspace(-60.0, 60.0, 2401)
    x, y = np.meshgrid(slopes, slopes, indexing="ij")
    z = 1.0 / np.sqrt(1.0 + x * x + y * y)
    # Slopes of a normal are those of the height field it stands on: minus x / z.
    density = distribution((x * z, y * z, z), (0.3, 0.2), 0.8) * z**4
    assert density.sum() * 0.05**2 == pytest.approx(1.0, abs=2e-3)
    inside = (np.abs(x - 0.24) < 3.0) & (np.abs(y) < 3.0)
    assert (density * x)[inside].sum() / density[inside].sum() == pytest.approx(0.24, abs=3e-3)


def test_lobes_turn_with_the_view_or_stay() -> None:
    wi, wo = view(40, 1.0), view(60, -0.3)
    for name, same in (("two lobes", True), ("of a fixed axis", False)):
        mixture = MIXTURES[name]
        before = mixture.pdf_components(wi, wo)
        after = mixture.pdf_components(rotate(wi, 0.8), rotate(wo, 0.8))
        assert np.allclose(before, after, rtol=1e-9) is same
        if not same:
            moved = replace(mixture, angle=mixture.angle + 0.8)
            after = moved.pdf_components(rotate(wi, 0.8), rotate(wo, 0.8))
            np.testing.assert_allclose(after, before, rtol=1e-9)


def test_parameters_are_linear_in_the_cosine_and_constant_beyond() -> None:
    mixture = MIXTURES["of the view"]
    (lobe,) = mixture.lobes

    def at(cosine: float) -> GgxMixture:
        def value(values: tuple[float, ...]) -> tuple[float]:
            return (float(np.interp(cosine, mixture.cosines, values)),)

        shape = (value(v) for v in (lobe.fraction, lobe.roughness, lobe.across, lobe.shift))
        lobes = (GgxLobe(*shape),)
        return GgxMixture(lobes, value(mixture.uniform), value(mixture.squared))

    wi = view(50, 0.2)
    for cosine in (0.05, 0.1, 0.3, 0.5, 0.8, 1.0):
        wo = view(math.degrees(math.acos(cosine)))
        expected = at(cosine).pdf_components(wi, wo)
        np.testing.assert_allclose(mixture.pdf_components(wi, wo), expected, rtol=1e-9)


GOOD = MIXTURES["of the view"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"lobes": ()}, "1 to 8 lobes"),
        ({"lobes": GOOD.lobes * 9}, "1 to 8 lobes"),
        ({"cosines": ()}, "1 to 16 cosines"),
        ({"cosines": (0.1, 1.0, 0.5)}, "must increase"),
        ({"cosines": (0.1, 0.5, 1.5)}, "cosines must lie"),
        ({"cosines": (0.1, math.nan, 1.0)}, "cosines must lie"),
        ({"uniform": (0.1, 0.1)}, "uniform must have 3 values, got 2"),
        ({"uniform": (0.9, 0.9, 0.9)}, "add up to 1"),
        ({"squared": (-0.1, 0.0, 0.0)}, "squared must lie"),
        ({"angle": 7.0}, "angle must lie"),
        ({"lobes": (replace(GOOD.lobes[0], fraction=(0.0, 0.0, 1.1)),)}, "fraction must lie"),
        ({"lobes": (replace(GOOD.lobes[0], roughness=(0.1, 0.1, 1e-4)),)}, "roughness must lie"),
        ({"lobes": (replace(GOOD.lobes[0], across=(0.1, 0.1, 5.0)),)}, "across must lie"),
        ({"lobes": (replace(GOOD.lobes[0], shift=(0.0, 0.0, math.inf)),)}, "shift must lie"),
    ],
)
def test_parameters_out_of_range_are_refused(change: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        replace(GOOD, **change)


def test_what_people_see() -> None:
    assert str(steady(0.25, 0.1)) == "25 % GGX normals of roughness 0.1, else diffuse"
    assert str(GOOD) == "20-50 % GGX normals of roughness 0.3-0.7, else diffuse"
