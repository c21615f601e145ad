"""Lobes of texels: their density, and that they follow what texels reflect."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

from nacre.measured.textures import BONN
from nacre.measured.textures.domes import pairs
from nacre.mitsuba.textures.plugins import texture_bsdf
from nacre.sampling.tilted import TiltedMixture, fit_tilted
from nacre.textures import LatentMap
from nacre.textures.capture import capture
from nacre.textures.capture.recipe import find
from nacre.textures.codecs import load_codec
from nacre.textures.codecs.codec_file import PUBLISHED
from tests.mitsuba.chi_square import chi_square
from tests.tiers import tiered

from .made import centres, hemisphere, hits

FAMILIES = "carpet", "fabric", "felt", "leather", "stone", "wallpaper", "wood"


@cache
def families() -> LatentMap:
    """A row of texels of each family, encoded by the included model."""
    wi, wo = pairs(BONN.directions[::8], BONN.directions[::8])
    codec = load_codec(PUBLISHED)
    encode = codec.encoder(wi, wo)
    rows = []
    for family in FAMILIES:
        surface = find(f"{family}12").build(48)
        table = capture(surface, wi, wo, 3, 1, samples=8)
        rows.append(encode(table.texels(slice(None))))
    return LatentMap(np.stack(rows), codec, wi, wo, "families")


class At:
    """A BSDF at one point of its texture."""

    def __init__(self, bsdf: Any, uv: tuple[float, float]) -> None:
        self._bsdf, self._uv = bsdf, uv

    def _placed(self, si: Any) -> Any:
        si.uv = type(si.uv)(*self._uv)
        return si

    def sample(self, context: Any, si: Any, *rest: Any) -> Any:
        return self._bsdf.sample(context, self._placed(si), *rest)

    def pdf(self, context: Any, si: Any, wo: Any) -> Any:
        return self._bsdf.pdf(context, self._placed(si), wo)


@pytest.fixture
def bsdf(rgb: Any) -> Any:
    return texture_bsdf(families(), decoder="network", interpolation="linear")


PLACES = [tuple(uv) for uv in centres(np.arange(7) * 3 + np.arange(7) % 3, 7, 3).tolist()]


@pytest.mark.parametrize("degrees", tiered([20.0, 65.0], [65.0]))
def test_samples_follow_the_density(rgb: Any, bsdf: Any, degrees: float) -> None:
    between = [(0.21, 0.33), (0.96, 0.995)]
    for uv in [*PLACES, *between]:
        test = chi_square(rgb, At(bsdf, uv), degrees, steps=12)
        assert test.run(test_count=2 * (len(PLACES) + 2), quiet=True), (uv, test.messages)


def test_a_density_that_is_off_is_found(rgb: Any, bsdf: Any) -> None:
    test = chi_square(rgb, At(bsdf, PLACES[3]), 20.0, lambda pdf, wo: 1.03 * pdf, steps=12)
    assert not test.run(quiet=True)


def test_weights_are_eval_over_pdf_and_bounded(rgb: Any) -> None:
    count, random = 6000, np.random.default_rng(3)
    bsdf = texture_bsdf(families(), resolution=8)
    uv, wo = random.random((count, 2)), hemisphere(count, 4, 0.2)
    si, context = hits(rgb, uv, wo), rgb.BSDFContext()
    u = random.random((3, count)).astype(np.float32)
    drawn, weight = bsdf.sample(context, si, rgb.Float(u[0]), rgb.Point2f(u[1:]))
    value, density = bsdf.eval_pdf(context, si, drawn.wo)
    pdf, weight = np.array(drawn.pdf), np.array(weight)
    np.testing.assert_allclose(pdf, np.array(density), rtol=2e-3, atol=1e-6)
    # Rounding of a direction may move it to another node of the table.
    same = np.isclose(weight * pdf, np.array(value), rtol=2e-2, atol=1e-4).all(0)
    assert same.mean() > 0.98
    assert weight.max() < 6.0


def test_the_fitted_lobe_is_at_least_as_good_as_the_one_that_was_there() -> None:
    lights, views = hemisphere(4000, 5, 0.01), hemisphere(5, 6, 0.6)
    wi, wo = np.tile(lights, (5, 1)), np.repeat(views, 4000, 0)
    areas = np.full(len(wi), 2.0 * np.pi / 4000, np.float32)

    def density(share: float, roughness: float, x: float, y: float) -> np.ndarray:
        mixture = TiltedMixture(share, roughness, (x, y))
        return np.asarray(mixture.pdf_components(tuple(wi.T), tuple(wo.T)))

    wanted = [(0.6, 0.32, 0.2, 0.0), (0.0, 1.0, 0.0, 0.0), (0.8, 0.15, 0.0, -0.45)]
    values = np.array([density(*row) for row in wanted])
    found = fit_tilted((values / wi[:, 2]).astype(np.float32), wi, wo, areas)
    for value, row, truth in zip(values, found.tolist(), wanted, strict=True):
        moments = [
            (value**2 / density(*p) * areas).reshape(5, -1).sum(1)
            / (value * areas).reshape(5, -1).sum(1) ** 2
            for p in (row, truth, (0.0, 1.0, 0.0, 0.0))
        ]
        assert moments[0].sum() <= 1.0001 * moments[1].sum()
        assert moments[0].sum() <= 1.0001 * moments[2].sum()
    np.testing.assert_allclose(found[1:], wanted[1:], atol=1e-5)
