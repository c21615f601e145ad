"""What textures reflect, against the codecs' own decoders and closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nacre
from nacre.array import Floats
from nacre.mitsuba.textures.plugins import texture_bsdf
from nacre.textures import LatentMap
from nacre.textures.codecs.networks import UnifiedNetwork, UnifiedSettings, Whitening
from nacre.textures.uniform import material_of
from tests.mitsuba.reflectances import sphere_scene
from tests.textures.codecs.basis.made import codec as basis_codec
from tests.variants import by_precision

from .made import FLIP, FlatCodec, centres, factors_at, hemisphere, latent

COUNT = 256


def decoded(source: LatentMap, texels: Any, wi: Floats, wo: Floats) -> Floats:
    """One value a texel and pair, by the codec's own decoder."""
    codes = source.codes.reshape(-1, source.codes.shape[2])[texels]
    every = source.codec.decoder(wi, wo)(codes.astype(np.float32))
    return every[np.arange(len(wi)), np.arange(len(wi))]


def papers_network() -> UnifiedNetwork:
    """A small one with random weights."""
    settings = UnifiedSettings(
        latent=4, angular=(8,), features=8, hidden=(8,), decoder_hidden=(12, 12)
    )
    return UnifiedNetwork(settings, Whitening(-1.0, 0.7), seed=2)


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        ("basis", {"coefficients": "texture"}),
        ("basis", {"coefficients": "hit"}),
        ("papers", {}),
    ],
)
def test_networks_at_hits_are_the_codec(rgb: Any, kind: str, options: dict[str, str]) -> None:
    codec = basis_codec(1) if kind == "basis" else papers_network()
    random = np.random.default_rng(8)
    source = latent(random.normal(size=(3, 5, codec.code_dim)), codec)
    bsdf = texture_bsdf(source, decoder="network", **options)
    texels, wi, wo = random.integers(0, 15, COUNT), hemisphere(COUNT, 1), hemisphere(COUNT, 2)
    found = factors_at(rgb, bsdf, centres(texels, 3, 5), wi, wo)
    expected = decoded(source, texels, wi, wo)
    tolerance = by_precision(1e-3)
    np.testing.assert_allclose(found, expected, rtol=tolerance, atol=tolerance * expected.mean())
    assert expected.std() > 0.01
    assert found.min() >= 0.0


def test_hits_in_memory_are_those_of_kernels_that_are_recorded(rgb: Any) -> None:
    import drjit as dr

    codec = papers_network()
    source = latent(np.random.default_rng(7).normal(size=(3, 5, codec.code_dim)), codec)
    bsdf = texture_bsdf(source, decoder="network", interpolation="linear")
    decoder = bsdf.decoder
    uv = rgb.Point2f(*np.random.default_rng(8).random((2, COUNT)).astype(np.float32))
    wi, wo = (tuple(rgb.Vector3f(hemisphere(COUNT, seed).T)) for seed in (1, 2))
    wi = wi[0], wi[1], dr.select(dr.arange(rgb.UInt32, COUNT) % 3 == 0, -wi[2], wi[2])
    texels = decoder.texels(bsdf.grid.around(uv))
    found = np.array(decoder.reflectance(texels, wi, wo))
    with dr.resume_grad():
        dr.enable_grad(wo[0])
        expected = np.array([dr.detach(v) for v in decoder.reflectance(texels, wi, wo)])
    counts = np.arange(COUNT) % 3 != 0
    tolerance = by_precision(1e-4)
    np.testing.assert_allclose(found[:, counts], expected[:, counts], rtol=tolerance)


@pytest.mark.parametrize("kind", ["basis", "papers"])
def test_tables_are_near_the_codec(rgb: Any, kind: str) -> None:
    codec = basis_codec(1) if kind == "basis" else papers_network()
    random = np.random.default_rng(9)
    source = latent(0.5 * random.normal(size=(3, 5, codec.code_dim)), codec)
    bsdf = texture_bsdf(source, interpolation="linear", resolution=12)
    texels, wi, wo = (
        random.integers(0, 15, COUNT),
        hemisphere(COUNT, 1, 0.3),
        hemisphere(COUNT, 2, 0.3),
    )
    found = factors_at(rgb, bsdf, centres(texels, 3, 5), wi, wo)
    expected = decoded(source, texels, wi, wo)
    error = np.sqrt(np.square(found - expected).mean() / np.square(expected).mean())
    assert error < 0.05
    assert expected.std() > 2.0 * error * expected.mean()


@pytest.mark.parametrize("decoder", ["table", "network"])
def test_between_texels_is_the_mean_of_reflectance(rgb: Any, decoder: str) -> None:
    codec = basis_codec(1)
    source = latent(3.0 * np.random.default_rng(4).normal(size=(1, 2, codec.code_dim)), codec)
    wi, wo = hemisphere(COUNT, 1, 0.3), hemisphere(COUNT, 2, 0.3)
    options = {"interpolation": "linear", "decoder": decoder, "coefficients": "texture"}
    bsdf = texture_bsdf(source, **options)
    first, between, second = (
        factors_at(rgb, bsdf, np.tile([u, 0.5], (COUNT, 1)), wi, wo) for u in (0.25, 0.5, 0.75)
    )
    np.testing.assert_allclose(between, 0.5 * (first + second), rtol=1e-3, atol=1e-4)
    roots = 0.25 * np.square(np.sqrt(first) + np.sqrt(second))
    assert roots.mean() < 0.95 * between.mean()


def test_a_pair_by_chance_is_as_the_linear_table_in_the_mean(rgb: Any) -> None:
    source = latent(np.random.default_rng(9).normal(size=(1, 1, 2)), basis_codec(1))
    wi, wo = (np.array([w], np.float32) for w in ([0.48, 0.2, 0.854], [-0.3, 0.52, 0.8]))
    near = np.random.default_rng(1).normal(0.0, 2e-4, (2, 20_000, 3)).astype(np.float32)
    many = [w + d for w, d in zip((wi, wo), near, strict=True)]
    many = [w / np.linalg.norm(w, axis=1, keepdims=True) for w in many]
    uv = np.full((20_000, 2), 0.5)
    linear, chance = (
        factors_at(rgb, texture_bsdf(source, interpolation=i, resolution=8), uv, *many)
        for i in ("linear", "stochastic")
    )
    assert chance.std(0).min() > 5.0 * linear.std(0).max()
    np.testing.assert_allclose(chance.mean(0), linear.mean(0), rtol=0.02)


def test_a_texel_is_rendered_as_the_material_that_it_is(rgb: Any) -> None:
    codec = basis_codec(1)
    one = latent(np.random.default_rng(4).normal(size=(1, 1, codec.code_dim)), codec)
    material = material_of(one)
    wi, wo = hemisphere(COUNT, 1, 0.3), hemisphere(COUNT, 2, 0.3)
    anywhere = np.random.default_rng(1).random((COUNT, 2))
    found = factors_at(rgb, nacre.mitsuba.bsdf(material), anywhere, FLIP * wi, FLIP * wo)
    expected = np.pi * material.eval(wi, wo)
    turned = np.pi * material.eval(FLIP * wi, FLIP * wo)
    error, other = (np.sqrt(np.square(found - e).mean()) for e in (expected, turned))
    assert error < 0.03 * expected.mean()
    assert error < 0.2 * other


def test_white_furnace(rgb: Any) -> None:
    color = np.array([1.0, 0.5, 0.25], np.float32)
    source = latent(np.broadcast_to(color, (2, 3, 3)), FlatCodec())
    bsdf = texture_bsdf(source, resolution=4)
    image = np.array(rgb.render(rgb.load_dict(sphere_scene(rgb, bsdf, size=8)), spp=2048, seed=3))
    np.testing.assert_allclose(image.mean((0, 1)), color, rtol=5e-3)


def test_nothing_below_the_horizon(rgb: Any) -> None:
    import drjit as dr

    bsdf = texture_bsdf(latent(np.ones((2, 2, 3)), FlatCodec()), resolution=4)
    w = np.random.default_rng(2).normal(size=(2, 400, 3))
    wi, wo = (w / np.linalg.norm(w, axis=-1, keepdims=True)).astype(np.float32)
    si = dr.zeros(rgb.SurfaceInteraction3f, 400)
    si.wi = rgb.Vector3f(np.ascontiguousarray(wo.T))
    light = rgb.Vector3f(np.ascontiguousarray(wi.T))
    value, density = (np.array(v) for v in bsdf.eval_pdf(rgb.BSDFContext(), si, light))
    lit = (wi[:, 2] > 0) & (wo[:, 2] > 0)
    assert not value.T[~lit].any()
    assert not density[~lit].any()
    np.testing.assert_allclose(value.T[lit], wi[lit, 2:].repeat(3, 1) / np.pi, rtol=2e-3)
    assert (density[lit] > 0).all()
