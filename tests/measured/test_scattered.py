"""Reflectance from scattered samples, and the interpolation between them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nacre.errors import NacreError
from nacre.geometry import split
from nacre.measured import ScatteredBrdf
from nacre.measured.interpolation import coordinates
from tests.measured.support import hemisphere, split_tensor
from tests.reflectances import Brushed
from tests.scans import AWKWARD, Gloss, awkward, everywhere, median_error, scan


def test_interpolation_passes_through_the_samples():
    brdf = scan(Gloss())
    samples = brdf.samples
    values = brdf.eval(samples.wi, samples.wo)
    assert values.dtype == np.float64
    np.testing.assert_allclose(values, samples.rgb, rtol=1e-3)
    np.testing.assert_array_equal(samples.cosine, samples.wi[:, 2])
    assert brdf.valid(samples.wi, samples.wo).mean() > 0.98
    np.testing.assert_array_equal(brdf.nearest(samples.wi, samples.wo), np.arange(len(samples)))


@pytest.mark.parametrize(("truth", "limit"), [(Gloss(), 0.01), (Brushed(), 0.1)])
def test_interpolation_resembles_what_was_sampled(truth, limit):
    assert median_error(truth, scan(truth)) < limit


def test_interpolation_is_exact_where_the_logarithm_is_a_plane():
    points = scan(Gloss(), 400)
    wi, wo = points.samples.wi, points.samples.wo
    random = np.random.default_rng(3)
    slopes = random.normal(0.0, 0.2, 4)

    def plane(wi, wo):
        f = np.exp(coordinates(split(wi), split(wo), True, True) @ slopes)
        return np.repeat(f[:, None], 3, axis=1)

    brdf = ScatteredBrdf(wi, wo, plane(wi, wo))
    middle = 0.5 * (wi[1:] + wi[:-1]), 0.5 * (wo[1:] + wo[:-1])
    middle = tuple(w / np.linalg.norm(w, axis=1, keepdims=True) for w in middle)
    error = np.abs(brdf.eval(*middle) / plane(*middle) - 1.0)
    assert np.quantile(error, 0.9) < 0.02


def test_values_stay_within_the_data_even_at_the_horizon():
    brdf = scan(Gloss(), 300)
    random = np.random.default_rng(4)
    wi, wo = hemisphere(random, 20_000), hemisphere(random, 20_000)
    wi[::2, 2] = wo[1::2, 2] = 1e-6
    wi, wo = (w / np.linalg.norm(w, axis=1, keepdims=True) for w in (wi, wo))
    values = brdf.eval(wi, wo)
    assert np.isfinite(values).all()
    assert (values <= brdf.samples.rgb.max(axis=0) * (1 + 1e-6)).all()
    assert (values >= brdf.samples.rgb.min(axis=0) * (1 - 1e-6)).all()
    assert not brdf.valid(wi[::2], wo[::2]).all()


def test_mirroring_is_a_choice_and_reciprocity_is_not_assumed():
    random = np.random.default_rng(5)
    wi, wo = (hemisphere(random, 500).astype(np.float64) for _ in range(2))
    flip = np.array([1.0, -1.0, 1.0])
    mirrored, plain = scan(Gloss()), scan(Gloss(), mirrored=False)
    np.testing.assert_allclose(mirrored.eval(wi, wo), mirrored.eval(wi * flip, wo * flip))
    assert (plain.eval(wi, wo) != plain.eval(wi * flip, wo * flip)).any()
    red, exchanged = mirrored.eval(wi, wo)[:, 0], mirrored.eval(wo, wi)[:, 0]
    tilted = np.abs(wi[:, 2] - wo[:, 2]) > 0.3
    assert ((red > exchanged) == (wi[:, 2] > wo[:, 2]))[tilted].mean() > 0.95


def test_an_anisotropic_scan_depends_on_the_azimuth():
    brdf = scan(Brushed())
    assert not brdf.mirrored
    wi = np.array([[0.5, 0.0, math.sqrt(0.75)], [0.0, 0.5, math.sqrt(0.75)]])
    across, along = brdf.eval(wi, [0.0, 0.0, 1.0])[:, 0]
    assert along > 1.5 * across


@pytest.mark.parametrize("name", AWKWARD)
def test_awkward_samples_give_finite_values_within_their_range(name):
    brdf = awkward(name)
    wi, wo = everywhere()
    values, rgb = brdf.eval(wi, wo), brdf.samples.rgb
    assert np.isfinite(values).all()
    assert (values >= rgb.min(axis=0) * (1 - 1e-9) - 1e-12).all()
    assert (values <= rgb.max(axis=0) * (1 + 1e-9) + 1e-12).all()
    assert brdf.valid(brdf.samples.wi, brdf.samples.wo).mean() > 0.9
    assert len(brdf.nearest(wi, wo)) == len(wi)


def test_few_samples_and_samples_of_one_kind_are_no_trouble():
    up = np.array([[0.0, 0.0, 1.0]])
    one = ScatteredBrdf(up, up, [[0.1, 0.2, -0.3]])
    random = np.random.default_rng(6)
    wi, wo = hemisphere(random, 100), hemisphere(random, 100)
    np.testing.assert_allclose(one.eval(wi, wo), np.tile([0.1, 0.2, 0.0], (100, 1)), atol=1e-6)
    same = ScatteredBrdf(wi, wo, np.full((100, 3), 0.25))
    np.testing.assert_allclose(same.eval(wo, wi), 0.25, rtol=1e-5)
    black = ScatteredBrdf(wi, wo, np.zeros((100, 3)))
    assert (black.eval(wo, wi) == 0.0).all()


def test_directions_below_the_horizon_do_not_raise():
    brdf = scan(Gloss(), 100)
    up = np.array([[0.0, 0.0, 1.0]])
    for other in ([0.0, 0.0, -1.0], [1.0, 0.0, 0.0]):
        assert (brdf.eval(up, other) == 0.0).all()
        assert not brdf.valid(up, other).any()


def test_other_array_libraries_are_refused_with_the_fix():
    torch = pytest.importorskip("torch", reason="needs the extra 'latent'")
    brdf = scan(Gloss(), 100)
    tensor = split_tensor(torch.ones(4, 3))
    for call in (brdf.eval_components, brdf.valid_components):
        with pytest.raises(NacreError, match=r"scan: scattered samples .* fit a network"):
            call(tensor, tensor)


def test_wrong_arguments_are_refused():
    up = np.array([[0.0, 0.0, 1.0]])
    for wrong, words in [
        ((up, up, [[1.0, 2.0]]), "shapes"),
        ((up, np.zeros((2, 3)), up), "shapes"),
        ((np.zeros((0, 3)),) * 3, "at least one"),
        ((up, up, [[np.nan, 1.0, 1.0]]), "finite"),
        ((-up, up, up), "above the horizon"),
    ]:
        with pytest.raises(ValueError, match=words):
            ScatteredBrdf(*wrong)
    with pytest.raises(ValueError, match="together"):
        ScatteredBrdf(up, up, up, spectra=[[1.0]])
    with pytest.raises(ValueError, match="bands"):
        ScatteredBrdf(up, up, up, spectra=[[1.0]], wavelengths=[500.0, 600.0])


def test_parts_keep_their_spectra():
    random = np.random.default_rng(8)
    wi, wo = hemisphere(random, 50), hemisphere(random, 50)
    spectra = random.random((50, 4))
    whole = ScatteredBrdf(
        wi, wo, spectra[:, :3], spectra=spectra, wavelengths=[400.0, 500.0, 600.0, 700.0]
    )
    part = whole.subset(np.array([3, 1]))
    np.testing.assert_array_equal(part.spectra, spectra[[3, 1]])
    np.testing.assert_array_equal(part.wavelengths, whole.wavelengths)


def test_dense_slices_far_apart_are_known_between() -> None:
    """Many views of lights at 10, 30, 50 and 70 degrees; nothing is known of other scans."""
    views = hemisphere(np.random.default_rng(1), 3000)
    angles = np.radians([10.0, 30.0, 50.0, 70.0])
    lights = np.stack([-np.sin(angles), 0.0 * angles, np.cos(angles)], axis=-1)
    wi, wo = np.repeat(lights, len(views), axis=0), np.tile(views, (4, 1))
    scan = ScatteredBrdf(wi, wo, np.ones((len(wi), 3)), isotropic=True)
    between = np.radians([15.0, 20.0, 40.0, 60.0])
    new = np.stack([-np.sin(between), 0.0 * between, np.cos(between)], axis=-1)
    inside = views[views[:, 2] > 0.2][:500]
    for light in new:
        assert scan.valid(light, inside).mean() > 0.95
    one = ScatteredBrdf(wi[:3000], wo[:3000], np.ones((3000, 3)), isotropic=True)
    assert one.valid(new[3], inside).mean() < 0.3
