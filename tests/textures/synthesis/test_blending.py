"""Mixtures of two materials, and masks for them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nacre.errors import FormatError, NacreError
from nacre.textures.alike import same_codec
from nacre.textures.synthesis import blend
from nacre.textures.synthesis.blending import named_mask, read_mask
from tests.textures.codecs.basis.made import codec
from tests.textures.synthesis.test_quilting import latent


def test_ends_are_the_materials_and_the_middle_is_the_mean():
    first, second = latent(6, 4), replace(latent(3, 5, seed=1, dtype="f4"), codec=codec())
    mask = np.zeros((9, 10), np.float32)
    mask[:, 5:] = 1.0
    mask[4] = 0.5
    found = blend(first, second, mask, keep_contrast=False)
    repeated = np.tile(first.codes, (2, 3, 1))[:9, :10], np.tile(second.codes, (3, 2, 1))
    expected = np.where(mask[..., None] == 1.0, repeated[1], repeated[0].astype("f4"))
    expected[4] = (repeated[0][4].astype("f4") + repeated[1][4]) / 2
    np.testing.assert_allclose(found.codes, expected, atol=1e-6)
    assert found.codes.dtype == np.float32
    assert found.name == "felt to felt"
    np.testing.assert_array_equal(found.codes[mask == 1.0], repeated[1][mask == 1.0])


def test_contrast_is_kept_where_unlike_textures_mix():
    first, second = latent(96, 96, dtype="f4"), latent(96, 96, seed=1, dtype="f4")
    half = np.full((96, 96), 0.5, np.float32)
    means = [blend(first, second, half, keep_contrast=kept) for kept in (True, False)]
    deviations = [float(m.codes.std((0, 1)).mean()) for m in means]
    before = float(first.codes.std((0, 1)).mean())
    assert deviations[0] == pytest.approx(before, rel=0.1)
    assert deviations[1] == pytest.approx(before / np.sqrt(2.0), rel=0.1)
    for mixed in means:
        middle = (first.codes.mean((0, 1)) + second.codes.mean((0, 1))) / 2
        np.testing.assert_allclose(mixed.codes.mean((0, 1)), middle, atol=1e-4)


def test_models_must_be_the_same():
    first, second = latent(), replace(latent(seed=1), codec=codec(seed=7))
    assert same_codec([first, replace(latent(), codec=codec())]) is None
    assert same_codec([first, second]) == 1
    with pytest.raises(NacreError, match="felt and felt were encoded by different models"):
        blend(first, second, np.zeros((4, 4), np.float32))


@pytest.mark.parametrize(
    ("mask", "message"),
    [
        (np.zeros((0, 4)), "a mask has 1 to"),
        (np.zeros(4), "a mask has 1 to"),
        (np.full((2, 2), np.nan), "values of a mask are numbers within 0 and 1"),
        (np.full((2, 2), 1.5), "values of a mask are numbers within 0 and 1"),
    ],
)
def test_bad_masks_are_named(mask, message):
    with pytest.raises(NacreError, match=message):
        blend(latent(), latent(seed=1), mask)


def test_made_masks():
    np.testing.assert_allclose(named_mask("right", 2, 3), [[0, 0.5, 1]] * 2)
    np.testing.assert_allclose(named_mask("down", 3, 2), [[0, 0], [0.5, 0.5], [1, 1]])
    noise = named_mask("noise", 64, 48, seed=2)
    np.testing.assert_array_equal(noise, named_mask("noise", 64, 48, seed=2))
    assert (noise != named_mask("noise", 64, 48, seed=3)).any()
    assert noise.min() == 0.0
    assert noise.max() == 1.0
    assert 0.3 < noise.mean() < 0.7
    assert named_mask("noise", 1, 1).shape == (1, 1)


def test_images_as_masks(tmp_path):
    image = pytest.importorskip("PIL.Image", reason="needs the extra 'render'")
    greys = np.array([[0, 255, 51], [102, 0, 255]], np.uint8)

    def written(name, pixels, mode=None):
        path = tmp_path / name
        image.fromarray(pixels, mode).save(path) if mode else image.fromarray(pixels).save(path)
        return path

    expected = greys / 255.0
    np.testing.assert_allclose(read_mask(written("grey.png", greys)), expected, atol=1e-6)
    wide = (greys.astype(np.uint16) * 257).astype(np.uint16)
    np.testing.assert_allclose(read_mask(written("wide.png", wide)), expected, atol=1e-6)
    colors = np.stack([greys] * 3, -1)
    np.testing.assert_allclose(read_mask(written("rgb.png", colors)), expected, atol=1e-6)
    opaque = np.dstack([colors, np.full((2, 3), 255, np.uint8)])
    np.testing.assert_allclose(read_mask(written("rgba.png", opaque)), expected, atol=1e-6)
    np.testing.assert_array_equal(read_mask(written("bits.png", greys > 99)), greys > 99)
    stretched = named_mask(tmp_path / "grey.png", 4, 6)
    np.testing.assert_allclose(stretched[0, [0, -1]], [0.0, 0.2], atol=1e-6)
    assert stretched.shape == (4, 6)

    colors[0, 0, 0] = 9
    opaque[0, 0, 3] = 9
    for name, pixels, message in (
        ("colour.png", colors, "is colored, and a mask is gray"),
        ("clear.png", opaque, "is transparent in places"),
    ):
        with pytest.raises(FormatError, match=message):
            read_mask(written(name, pixels))
    palette = image.fromarray(greys).convert("P")
    palette.save(tmp_path / "palette.png")
    (tmp_path / "text.png").write_text("no image")
    (tmp_path / "cut.png").write_bytes((tmp_path / "rgb.png").read_bytes()[:50])
    for name, message in (
        ("palette.png", "is of kind P; save it as a gray image"),
        ("text.png", "a mask is a gray PNG or JPEG image"),
        ("cut.png", "cut.png: cannot be decoded"),
        ("none.png", r"is neither a file nor a named mask \(right, down, noise\)"),
    ):
        with pytest.raises(FormatError, match=message):
            read_mask(tmp_path / name)
