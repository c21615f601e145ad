"""Networks that the noise of a scan leaves as plausible, and what they say about f_r."""

from __future__ import annotations

import base64
import functools
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.analytic import MODELS
from nacre.errors import FormatError, NacreError
from nacre.geometry import from_spherical, join
from nacre.latent.estimates import bounds, facts, kept_networks, plausible
from nacre.latent.intervals import interval
from nacre.measured import ScatteredBrdf
from nacre.neural import NeuralBrdf, ensemble
from nacre.runtime.progress import silent
from tests.measured.support import hemisphere

PAINT = MODELS["ggx"](
    diffuse=(0.2, 0.1, 0.05), specular=(0.04, 0.04, 0.04), roughness=0.3, name="paint"
)
NOISE = 0.05


def scan(sigma: bool = True) -> ScatteredBrdf:
    rng = np.random.default_rng(0)
    wi, wo = hemisphere(rng, 700), hemisphere(rng, 700)
    keep = np.minimum(wi[:, 2], wo[:, 2]) > 0.25
    wi, wo = wi[keep], wo[keep]
    exact = PAINT.eval(wi, wo).astype(np.float64)
    spread = NOISE * exact.mean(axis=1)
    values = exact + spread[:, None] * rng.normal(size=(len(wi), 1))
    return ScatteredBrdf(wi, wo, values, "paint", sigma=spread if sigma else None)


@functools.cache
def fitted(count: int = 3) -> NeuralBrdf:
    network = nacre.fit(scan(), "draft", epochs=40)
    assert isinstance(network, NeuralBrdf)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ensemble, "COUNT", count)
        if count < 16:  # what is stored does not depend on how good they are
            patch.setattr(ensemble, "_SAMPLES", 8000)
            patch.setattr(ensemble, "_EPOCHS", 5)
        return kept_networks(network, scan(), silent)


def directions() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(7)
    theta, phi = np.radians(rng.uniform(0, 70, (2, 2000))), rng.uniform(0, np.pi, 2000)
    wi = join(from_spherical(theta[0], 0.0 * phi))
    return wi, join(from_spherical(theta[1], phi))


@pytest.mark.slow
def test_intervals_hold_the_truth_about_as_often_as_they_say() -> None:
    pair = directions()
    network = fitted(16)
    low, high = bounds(network, *pair)
    truth = PAINT.eval(*pair)
    inside = ((low <= truth) & (truth <= high)).mean()
    assert 0.8 < inside <= 0.995
    # Narrower than single samples: many of these say the same.
    assert np.median(high / low) < np.exp(2 * 1.645 * NOISE)


def test_plausible_networks_come_back_from_the_file(tmp_path: Path) -> None:
    nacre.save(fitted(), tmp_path / "paint.safetensors")
    again = nacre.load(tmp_path / "paint.safetensors")
    pair = directions()
    before, after = plausible(fitted()), plausible(again)
    assert len(after) == 3
    for a, b in zip(before, after, strict=True):
        np.testing.assert_array_equal(a.eval(*pair), b.eval(*pair))
    known = facts(again)
    assert known["known from samples"] == len(scan().samples)
    low, high = known["plausible albedo from"], known["plausible albedo to"]
    assert np.all(np.array(low) < again.albedo())
    assert np.all(again.albedo() < np.array(high))


@pytest.mark.slow
def test_tables_have_the_uncertainties_that_intervals_mean(tmp_path: Path) -> None:
    for name in ("paint.csv", "paint.bird.brdf"):
        nacre.convert(fitted(16), tmp_path / name)
        table = nacre.load(tmp_path / name)
        assert table.samples.sigma is not None
        measured = np.minimum(table.samples.wi[:, 2], table.samples.wo[:, 2]) > 0.3
        level = table.samples.rgb.mean(axis=1)
        ratio = np.median((table.samples.sigma / level)[measured])
        assert 0.3 * NOISE < ratio < 1.5 * NOISE


def test_networks_without_intervals_have_none() -> None:
    network = nacre.fit(scan(), "draft", epochs=2)
    assert plausible(network) == []
    assert facts(network) == {}


def test_stored_weights_are_close_and_damage_is_named() -> None:
    network = fitted()
    others = [network.with_layers([type(x)(x.weights * 1.01, x.biases) for x in network.layers])]
    (back,) = ensemble.restored(network, ensemble.stored(network, others))
    pair = directions()
    np.testing.assert_allclose(back.eval(*pair), others[0].eval(*pair), rtol=1e-3)
    kept = network.metadata["plausible"]
    for wrong in ("x", base64.b64encode(b"abc").decode(), 7):
        damaged = network.replaced(
            metadata={**network.metadata, "plausible": {**kept, "networks": wrong}}
        )
        with pytest.raises(FormatError, match="plausible materials: cannot be read"):
            plausible(damaged)
    infinite = np.full(network.weight_count, np.inf, "<f2").tobytes()
    with pytest.raises(ValueError, match="not finite"):
        ensemble.restored(network, base64.b64encode(infinite).decode())


def test_what_is_missing_is_named() -> None:
    with pytest.raises(NacreError, match="paint: intervals need its uncertainties"):
        nacre.fit(scan(sigma=False), "draft", epochs=1, intervals=True)
    with pytest.raises(NacreError, match="paint: nothing says how well it is known"):
        bounds(PAINT, *directions())
    with pytest.raises(NacreError, match="paint: intervals are for scans"):
        nacre.fit(PAINT, "draft", epochs=1, samples=2000, intervals=True)


def test_a_few_values_have_students_interval() -> None:
    from scipy.stats import t

    values = np.random.default_rng(2).normal(size=(9, 4))
    low, high = interval(values)
    spread = values.std(axis=0, ddof=1) * np.sqrt(1 + 1 / 9)
    expected = t.interval(0.9, 8, values.mean(axis=0), spread)
    np.testing.assert_allclose((low, high), expected)
    many = np.random.default_rng(2).normal(size=(400, 4))
    np.testing.assert_allclose(interval(many), np.quantile(many, [0.05, 0.95], axis=0))


def test_samples_with_less_noise_are_repeated_more_often() -> None:
    from nacre.neural.scattered import repeated

    samples = scan().samples
    sigma = np.where(np.arange(len(samples)) % 2, 0.5, 0.02) * samples.rgb.mean(axis=1)
    chosen = repeated(type(samples)(samples.wi, samples.wo, samples.rgb, sigma), 6000, 0)
    assert abs(len(chosen) - 6000) < len(samples)
    noisy = np.isclose(chosen.sigma / chosen.rgb.mean(axis=1), 0.5).mean()
    assert 0.02 < noisy < 0.12
