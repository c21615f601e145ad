"""Environments as pages hold them, against the maps they are made of."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from nacre.array import Floats
from nacre.mitsuba.environment import Environment, pixel_directions
from nacre.mitsuba.surroundings import ENVIRONMENTS
from nacre.viewer.content import MAP_SIZE, Content
from nacre.viewer.maps import coded
from tests.tiers import tiered
from tests.viewer.tab import Tab, page
from tests.viewer.test_page import EXAMPLES, Entry

BYTES = 110_000
"""For all of the package's maps together, gzipped."""

PIXELS = """(k) => {
  const { renderer, facts, bytes } = window.page;
  renderer.light(facts.environments[k], bytes);
  const { gl } = renderer, { width, height } = facts.environments[k];
  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
  const { texels } = renderer.environment;
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texels, 0);
  const found = new Float32Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, found);
  return window.encoded(found);
}"""


@cache
def made(name: str, rows: int) -> Environment:
    return ENVIRONMENTS[name](rows).exposed()


def read_back(tab: Tab, given: list[Environment]) -> list[Environment]:
    """Maps as a page decodes them."""
    from tests.oracles.runners import browser

    tab.open(page("Maps", [Entry("One", {"Only": EXAMPLES["lambert"]})], given))
    found = [browser.floats(tab.page.evaluate(PIXELS, k)) for k in range(len(given))]
    return [
        Environment(np.float32(values.reshape(*each.pixels.shape[:2], 4)[..., :3]), each.name)
        for values, each in zip(found, given, strict=True)
    ]


def lobes(environment: Environment, power: float) -> Floats:
    """Light around some directions, weighted by powers of cosines: what rough balls show."""
    directions, angles = pixel_directions(*environment.pixels.shape[:2])
    centers = np.random.default_rng(0).normal(size=(24, 3))
    centers /= np.linalg.norm(centers, axis=1, keepdims=True)
    cosine = np.clip(directions @ centers.T, 0.0, None) ** power * angles[:, None, None]
    light = np.einsum("hwk,hwc->kc", cosine, environment.pixels)
    return np.asarray(light / cosine.sum((0, 1))[:, None])


def check(found: Environment, wanted: Environment) -> None:
    for power, error in ((1.0, 0.004), (20.0, 0.006), (400.0, 0.02)):
        np.testing.assert_allclose(lobes(found, power), lobes(wanted, power), rtol=error)
    # A mirror ball's light, as it is shown.
    shown = [np.clip(each.pixels, 0.0, 1.0) ** (1 / 2.2) for each in (found, wanted)]
    assert np.sqrt(np.mean((shown[0] - shown[1]) ** 2)) < 0.006


@pytest.mark.parametrize("rows", tiered([128, 512], [128]))
def test_maps_survive_their_coding(tab: Tab, rows: int) -> None:
    given = [made(name, rows) for name in ENVIRONMENTS]
    for found, wanted in zip(read_back(tab, given), given, strict=True):
        check(found, wanted)


def test_maps_of_odd_sizes_and_of_noise_are_read_back(tab: Tab) -> None:
    random = np.random.default_rng(1)
    shapes = (7, 10), (64, 130), (2, 4)
    noise = [Environment(np.float32(random.lognormal(size=(*s, 3))), "noise") for s in shapes]
    given = [each.exposed() for each in noise]
    for found, wanted in zip(read_back(tab, given), given, strict=True):
        floor = 0.01 * float(wanted.pixels.mean())
        np.testing.assert_allclose(found.pixels, wanted.pixels, rtol=0.35, atol=floor)


def test_the_package_has_large_maps_in_few_bytes() -> None:
    import gzip

    own = [made(name, MAP_SIZE[1]) for name in ENVIRONMENTS]
    assert all(each.pixels.shape == (*MAP_SIZE[::-1], 3) for each in own)
    assert sum(len(gzip.compress(coded(each.pixels)[0])) for each in own) < BYTES


def test_larger_maps_are_reduced_to_a_pages_size() -> None:
    content = Content([Environment(np.ones((600, 1200, 3), np.float32))], thumbnails=False)
    (shown,) = content.facts["environments"]
    assert (shown["width"], shown["height"]) == MAP_SIZE
