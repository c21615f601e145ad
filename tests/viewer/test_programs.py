"""Networks that share a text: their numbers, angles and samplers are filled in by the page."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from nacre.brdf import Sampler
from nacre.mitsuba.studio import studio
from nacre.neural.nbrdf import NeuralBrdf
from nacre.numerics.mlp import Layer
from nacre.sampling import BlinnPhongMixture, GgxLobe, GgxMixture
from nacre.viewer.content import Entry
from tests.oracles.pairs import pairs
from tests.spectra import spectral_network
from tests.viewer.tab import Tab, page

DRAWN = """([index, wo, u]) => {
  const { renderer, materials } = window.page, { gl } = renderer;
  const { glsl } = materials.shown(materials.list[index].forms[0]), count = wo.length / 4;
  const held = [wo, u].map((values) =>
    renderer.texture([count, 1], new Float32Array(values)));
  const target = renderer.target(1, [count, 1]);
  const head = "#version 300 es\\nprecision highp float;\\n";
  const program = renderer.program(
    `${head}void main() {
       gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }`,
    `${head}${glsl}\\nuniform sampler2D from, places; out vec4 color;
     void main() { ivec2 at = ivec2(gl_FragCoord.xy);
       color = material_sample(texelFetch(from, at, 0).xyz, texelFetch(places, at, 0).xyz); }`);
  renderer.fill(target, program, { from: held[0], places: held[1] });
  return [...renderer.read(target)];
}"""
VALUES = """([index, wi, wo]) => {
  const { renderer, materials } = window.page;
  const found = materials.shown(materials.list[index].forms[0]);
  return [...renderer.values(found, new Float32Array(wi), new Float32Array(wo))];
}"""


def network(seed: int, sampler: Sampler, angle: float) -> NeuralBrdf:
    generator = np.random.default_rng(seed)
    sizes = 8, 5, 3
    layers = [
        Layer(*(generator.normal(0.0, 0.5, shape).astype(np.float32) for shape in ((a, b), b)))
        for a, b in itertools.pairwise(sizes)
    ]
    return NeuralBrdf(
        layers, isotropic=False, inputs="enhanced", sampler=sampler, angle=angle, name=f"{seed}"
    )


def normalized(w: np.ndarray) -> np.ndarray:
    return (w / np.linalg.norm(w, axis=1, keepdims=True)).astype(np.float32)


def mixture(angle: float | None, lobes: int = 2) -> GgxMixture:
    lobe = GgxLobe((0.3, 0.2), (0.3, 0.1), (0.1, 0.4), (0.2, -0.4))
    return GgxMixture((lobe,) * lobes, (0.1, 0.2), (0.2, 0.1), (0.2, 1.0), angle)


NETWORKS = [
    network(1, mixture(0.7), 0.4),
    network(2, mixture(-1.1), 1.2),
    network(3, mixture(None, 1), 0.0),
    network(4, BlinnPhongMixture(0.4, 37.5), 0.9),
    network(5, BlinnPhongMixture(0.7, 12.0), 0.9),
]


@pytest.fixture(scope="module")
def several() -> bytes:
    return page("Networks", [Entry(each.name, {"Network": each}) for each in NETWORKS], [studio()])


@pytest.mark.slow
def test_networks_with_other_axes_and_samplers_give_their_own_numbers(tab: Tab, several: bytes):
    tab.open(several)
    assert tab.page.evaluate("window.page.facts.templates.length") == 3
    wi, wo = (part[:500].astype(np.float32) for part in pairs(4096))
    u = np.random.default_rng(7).random((len(wo), 3)).astype(np.float32)
    u = np.floor(u * 2.0**24) / 2.0**24
    flat = [w.ravel().tolist() for w in (wi, wo)]
    padded = [np.pad(w, ((0, 0), (0, 1))).ravel().tolist() for w in (wo, u)]
    for index, each in enumerate(NETWORKS):
        found = np.reshape(tab.page.evaluate(VALUES, [index, *flat]), (-1, 4))
        np.testing.assert_allclose(found[:, :3], each.eval(wi, wo), rtol=2e-4, atol=2e-6)
        np.testing.assert_allclose(found[:, 3], each.pdf(wi, wo), rtol=2e-3, atol=1e-5)
        drawn = np.reshape(tab.page.evaluate(DRAWN, [index, *padded]), (-1, 4))
        lit = drawn[:, 3] > 0.0
        assert lit.mean() == pytest.approx(
            (each.sample(wo, u.astype(np.float32))[1] > 0.0).mean(), abs=0.02
        )
        density = each.pdf(normalized(drawn[lit, :3]), wo[lit])
        assert np.isclose(drawn[lit, 3], density, rtol=1e-2).mean() > 0.98


@pytest.mark.slow
def test_a_spectral_network_is_shown_in_its_color(tab: Tab):
    material = spectral_network()
    tab.open(page("Spectrum", [Entry("random", {"Network": material})], [studio()]))
    wi, wo = (part[:500].astype(np.float32) for part in pairs(4096))
    given = [w.ravel().tolist() for w in (wi, wo)]
    found = np.reshape(tab.page.evaluate(VALUES, [0, *given]), (-1, 4))
    np.testing.assert_allclose(found[:, :3], material.eval(wi, wo), rtol=2e-4, atol=2e-6)
    assert found[:, :3].max() > 0.1
    assert "Neural network" in tab.page.inner_text("body")
    tab.keep("spectral network")
