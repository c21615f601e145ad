"""Encoded textures as materials of three.js, with either of its renderers."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from functools import cache

import numpy as np
import pytest

from nacre.array import Floats, Weights
from nacre.geometry import join, split
from nacre.targets import TARGETS
from tests.oracles.runners import three as pages
from tests.oracles.texture_runners.three import plane
from tests.oracles.textures import Points, TextureTruth
from tests.targets.made_texture import HEIGHT, NAME, WIDTH, atlas, texture
from tests.targets.support import needs
from tests.tiers import tiered

RENDERERS = "webgl", "webgpu", "fallback"
LIGHT = np.array([0.48, -0.36, 0.8])
STEPS = 0.7548777, 0.5698403


@pytest.fixture(autouse=True)
def _installed() -> None:
    needs(pages.missing())


@cache
def module() -> Mapping[str, bytes]:
    flat = dataclasses.replace(atlas(), heights=None)
    return TARGETS["three"]().texture_files(texture(), flat, NAME)


@cache
def truth() -> TextureTruth:
    return TextureTruth(module(), NAME, HEIGHT, WIDTH)


def seen(size: tuple[int, int], repeat: float, wi: Weights) -> Points:
    """Pixels of a plane of repeated textures from above."""
    width, height = size
    y, x = np.indices((height, width)).reshape(2, -1) + 0.5
    uv = np.stack([repeat * x / width, 1.0 - repeat * (1.0 - y / height)], axis=1)
    level = np.log2(max(repeat / width * WIDTH, repeat / height * HEIGHT, 1.0))
    up = np.tile(np.float32([0.0, 0.0, 1.0]), (len(uv), 1))
    light = np.broadcast_to(wi, up.shape).astype(np.float32)
    return Points(uv.astype(np.float32), np.full(len(uv), level, np.float32), light, up)


@pytest.mark.parametrize(("size", "repeat"), [((21, 15), 1.0), ((10, 12), 4.0)])
@pytest.mark.parametrize("renderer", tiered(RENDERERS, RENDERERS[-1:]))
def test_a_plane_has_the_texture_upright_and_filtered(
    renderer: str, size: tuple[int, int], repeat: float
) -> None:
    options = {"repeat": repeat, "light": LIGHT.tolist(), "samples": 0}
    found = plane(module(), NAME, renderer, size, **options)[..., :3].reshape(-1, 3)
    expected = LIGHT[2] * truth().evaluate(seen(size, repeat, LIGHT))
    np.testing.assert_allclose(found, expected, rtol=5e-4, atol=1e-4)


@pytest.mark.parametrize("renderer", tiered(RENDERERS, RENDERERS[:1]))
def test_surroundings_are_seen_in_directions_that_the_lobes_draw(renderer: str) -> None:
    size, samples = (7, 5), 6
    found = plane(module(), NAME, renderer, size, repeat=1.0, environment=0.5, samples=samples)
    total: Floats = np.zeros((size[0] * size[1], 3))
    for k in range(samples):
        u = ((k + 0.5) / samples, *(np.modf(0.5 + k * step)[0] for step in STEPS))
        at = seen(size, 1.0, np.array([0.0, 0.0, 1.0]))
        numbers = tuple(np.full(len(at.uv), number) for number in u)
        wi = join(truth().lobe(at.uv).sample_components(split(at.wo.astype(float)), numbers)[0])
        drawn = dataclasses.replace(at, wi=wi.astype(np.float32))
        pdf = truth().pdf(drawn)[:, None]
        weights = np.where(pdf > 0.0, wi[:, 2:] / np.maximum(pdf, 1e-12), 0.0)
        total += 0.5 / samples * weights * truth().evaluate(drawn)
    error = np.abs(found[..., :3].reshape(-1, 3) / total - 1.0)
    assert np.quantile(error, 0.95) < 1e-3
    assert error.max() < 0.05  # where slopes cancel, rounding decides about the azimuth
