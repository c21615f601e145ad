"""Metrics against closed forms and against the libraries they rest on."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nacre.array import Components
from nacre.brdf import Brdf
from nacre.color import tone_map
from nacre.errors import NacreError
from nacre.metrics import angular_errors, delta_itp, flip, image_errors

pytest.importorskip("skimage", reason="needs the extra 'render'")


class Grey(Brdf):
    """A constant reflectance, known up to a given polar angle of the light."""

    def __init__(self, value: float, limit: float = 0.0) -> None:
        self.value, self.limit = value, limit

    def eval_components(self, wi: Components, wo: Components) -> Components:
        """See :class:`nacre.brdf.Brdf`."""
        value = self.value + 0.0 * (wi[2] + wo[2])
        return value, value, value

    def valid_components(self, wi: Components, wo: Components):
        """See :class:`nacre.brdf.Brdf`."""
        return wi[2] > self.limit + 0.0 * wo[2]


def noise(seed: int, size: int = 24) -> np.ndarray:
    """A picture of independent uniform values."""
    return np.random.default_rng(seed).random((size, size, 3), dtype=np.float32)


def test01_equal_pictures_have_no_error():
    errors, flip_map = image_errors(noise(0), noise(0).copy())
    assert (errors.mae, errors.rmse, errors.psnr, errors.flip) == (0.0, 0.0, math.inf, 0.0)
    assert errors.ssim == pytest.approx(1.0)
    np.testing.assert_array_equal(flip_map, np.zeros((24, 24)))


@pytest.mark.parametrize("offset", [0.01, 0.1, -0.3])
def test02_constant_offset_after_tone_mapping(offset: float):
    truth = np.full((16, 16, 3), 0.5) ** 2.2
    other = np.full((16, 16, 3), 0.5 + offset) ** 2.2
    errors, _ = image_errors(truth, other)
    assert errors.mae == pytest.approx(abs(offset), rel=1e-6)
    assert errors.rmse == pytest.approx(abs(offset), rel=1e-6)
    assert errors.psnr == pytest.approx(-20.0 * math.log10(abs(offset)), rel=1e-6)
    # Two flat pictures: only the luminance term of SSIM is left.
    a, b, c = 0.5, 0.5 + offset, 0.01**2
    assert errors.ssim == pytest.approx((2 * a * b + c) / (a * a + b * b + c), rel=1e-4)
    assert 0.0 < errors.flip < 1.0


def test03_values_beyond_one_are_clipped():
    errors, _ = image_errors(np.full((8, 8, 3), 1.0), np.full((8, 8, 3), 40.0))
    assert errors.mae == 0.0


def test04_the_mask_selects_pixels():
    truth, other = noise(1), noise(1)
    mask = np.zeros((24, 24), bool)
    mask[:12] = True
    other[12:] = 0.0
    errors, flip_map = image_errors(truth, other, mask)
    assert errors.mae == 0.0
    assert errors.ssim < 0.9
    assert errors.flip == pytest.approx(flip_map[mask].mean())


def test05_ssim_is_that_of_scikit_image():
    from skimage.metrics import structural_similarity

    truth, other = noise(2), noise(2) * 0.9
    errors, _ = image_errors(truth, other)
    expected = structural_similarity(
        tone_map(truth), tone_map(other), channel_axis=-1, data_range=1.0
    )
    assert errors.ssim == float(expected)


def test06_flip_is_that_of_its_authors():
    flip_evaluator = pytest.importorskip("flip_evaluator", reason="has no wheel here")
    truth, other = noise(3), noise(4)
    for second in (other, truth + 0.05 * (other - truth), np.float32(0.98) * truth):
        theirs, _, _ = flip_evaluator.evaluate(truth, second, "LDR", applyMagma=False)
        np.testing.assert_allclose(flip(truth, second), theirs[..., 0], atol=5e-5)
    _, mean, _ = flip_evaluator.evaluate(truth, other, "LDR", applyMagma=False)
    errors, _ = image_errors(truth**2.2, other**2.2)
    assert errors.flip == pytest.approx(mean, rel=1e-3)


def test07_flip_is_largest_between_green_and_blue():
    green, blue = (np.full((3, 5, 3), np.eye(3)[index]) for index in (1, 2))
    np.testing.assert_allclose(flip(green, blue), np.ones((3, 5)), rtol=1e-6)


def test08_pictures_that_do_not_compare_are_refused():
    with pytest.raises(ValueError, match="do not compare"):
        image_errors(noise(0), noise(0, 23))
    with pytest.raises(ValueError, match="selects nothing"):
        image_errors(noise(0), noise(0), np.zeros((24, 24), bool))


def test09_a_reflectance_agrees_with_itself():
    errors = angular_errors(Grey(0.3), Grey(0.3), count=1000)
    assert 400 < errors.count < 1000
    assert (errors.log_cosine, errors.relative_median, errors.rmse_cosine) == (0.0, 0.0, 0.0)


def test10_twice_as_bright():
    errors = angular_errors(Grey(0.2), Grey(0.4), count=5000, seed=3)
    assert errors.relative_median == pytest.approx(1.0, rel=1e-5)
    # At most, where the cosine is one; the square root of the mean square in proportion to it.
    assert 0.0 < errors.log_cosine < errors.log_cosine_p95 < math.log(1.4 / 1.2)
    assert 0.0 < errors.rmse_cosine < 0.2


def test11_invalid_samples_do_not_count():
    every = angular_errors(Grey(0.2), Grey(0.4), count=5000)
    some = angular_errors(Grey(0.2, limit=0.8), Grey(0.4), count=5000)
    assert some.count < every.count
    assert some.rmse_cosine > 0.2 * 0.8
    with pytest.raises(NacreError, match="known at none of"):
        angular_errors(Grey(0.2, limit=1.0), Grey(0.4), count=100)


def test12_the_seed_decides():
    first = angular_errors(Grey(0.2), Grey(0.4), count=1000, seed=1)
    assert first == angular_errors(Grey(0.2), Grey(0.4), count=1000, seed=1)
    assert first != angular_errors(Grey(0.2), Grey(0.4), count=1000, seed=2)


def test13_a_black_reference_has_no_relative_error():
    errors = angular_errors(Grey(0.0), Grey(0.4), count=1000)
    assert errors.relative_median == 0.0
    assert errors.log_cosine > 0.0


def test14_color_differences_are_those_of_the_recommendations():
    """ITU-R BT.2087 to wide primaries, BT.2100 to ICtCp, BT.2124 to the difference."""
    wide = [[0.6274, 0.3293, 0.0433], [0.0691, 0.9195, 0.0114], [0.0164, 0.0880, 0.8956]]
    cones = np.array([[1688, 2146, 262], [683, 2951, 462], [99, 309, 3688]]) / 4096
    opponents = np.array([[2048, 2048, 0], [6610, -13613, 7003], [17933, -17390, -543]]) / 4096

    def encoded(picture):
        light = 203.0 * np.clip(picture, 0.0, 1.0) @ np.array(wide).T @ cones.T / 10_000
        power = light ** (2610 / 16384)
        top = 3424 / 4096 + 2413 / 128 * power
        values = (top / (1.0 + 2392 / 128 * power)) ** (2523 / 32)
        return values @ opponents.T * [1.0, 0.5, 1.0]

    truth, other = noise(1, 8), 1.5 * noise(2, 8)
    expected = 720.0 * np.linalg.norm(encoded(truth) - encoded(other), axis=-1)
    np.testing.assert_allclose(delta_itp(truth, other), expected, rtol=2e-3, atol=0.05)
    np.testing.assert_array_equal(delta_itp(truth, truth), 0.0)


def test15_color_differences_are_those_of_colour_science():
    colour = pytest.importorskip("colour", reason="colour-science computes them too")
    truth, other = noise(1, 8), 1.5 * noise(2, 8)
    wide = (
        colour.RGB_to_RGB(np.clip(picture, 0.0, 1.0), "ITU-R BT.709", "ITU-R BT.2020")
        for picture in (truth, other)
    )
    expected = colour.difference.delta_E_ITP(*(colour.RGB_to_ICtCp(203.0 * w) for w in wide))
    np.testing.assert_allclose(delta_itp(truth, other), expected, rtol=1e-9)
