"""Codes at a rate: how many bytes, what is lost, in which order, and files of them."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from nacre.errors import FormatError, NacreError
from nacre.io.files import digest
from nacre.measured.textures.domes import BONN
from nacre.textures import LatentMap, NeuralBtf, load_latent_map, save_latent_map
from nacre.textures.codecs import save_codec
from nacre.textures.latent_file import load_latent_maps
from nacre.textures.latent_map import CodecFile
from nacre.textures.limit import Rate, limited
from nacre.textures.synthesis import blend
from nacre.workflows.rating import rated, recoded
from tests.textures.codec_files import header_and_tensors, rewrite
from tests.textures.rates.made import latent


def loss(one: LatentMap, truth: LatentMap) -> float:
    """The mean squared difference of square roots of reflectance."""
    seen = truth.codec.embedding(*BONN.pairs())
    places = [seen(m.codes.reshape(-1, truth.codec.code_dim)) for m in (one, truth)]
    return float(np.square(places[0] - places[1]).sum(1).mean())


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "felt.safetensors"
    save_latent_map(limited(latent(), Rate(2.0)), path)
    return path


def test_bytes_are_those_asked_for_and_more_lose_less() -> None:
    before = latent()
    losses = []
    for wanted in (0.5, 1.0, 2.0, 4.0):
        found = limited(before, Rate(wanted))
        assert found.rated is not None
        assert 0.95 * wanted < found.rated.bytes_per_texel <= wanted
        losses.append(loss(found, before))
    assert all(b < 0.6 * a for a, b in pairwise(losses))
    plain = float(np.square(before.codes - before.codes.mean((0, 1))).sum(2).mean())
    assert losses[-1] < 1e-2 * plain


@pytest.mark.parametrize("quality", [25.0, 45.0])
def test_the_quality_is_the_loss_of_roots(quality: float) -> None:
    before = latent()
    found = limited(before, Rate(quality=quality))
    assert -10.0 * np.log10(loss(found, before)) == pytest.approx(quality, abs=0.5)


def test_a_rounded_code_is_better_than_equal_bytes_of_fewer_bits() -> None:
    """Against the codes themselves in a byte each, from lowest to highest: six bytes."""
    before = latent()
    low, high = before.codes.min((0, 1)), before.codes.max((0, 1))
    step = (high - low) / 255.0
    plain = replace(before, codes=(low + np.round((before.codes - low) / step) * step))
    found = limited(before, Rate(6.0))
    assert loss(found, before) < 0.2 * loss(plain, before)


def test_a_texture_too_small_for_its_axes_is_refused() -> None:
    with pytest.raises(NacreError, match=r"12 texels take .* at least"):
        limited(latent(3, 4), Rate(0.5))


def test_one_color_takes_next_to_nothing() -> None:
    flat = replace(latent(), codes=np.full((70, 150, 6), 0.25, np.float32))
    found = limited(flat, Rate(0.5))
    assert found.codes == pytest.approx(flat.codes, abs=1e-6)
    assert found.rated is not None
    assert found.rated.bytes_per_texel < 0.02


@pytest.mark.parametrize(
    ("rate", "message"),
    [((), "either"), ((1.0, 30.0), "either"), ((0.4,), "0.5 to 64"), ((None, 90.0), "10 to 80")],
)
def test_rates_out_of_range_are_refused(rate: tuple, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Rate(*rate)


def test_a_file_comes_back_bit_by_bit(path: Path, tmp_path: Path) -> None:
    before, after = limited(latent(), Rate(2.0)), load_latent_map(path)
    np.testing.assert_array_equal(after.codes, before.codes)
    again = tmp_path / "again.safetensors"
    save_latent_map(after, again)
    assert again.read_bytes() == path.read_bytes()
    assert NeuralBtf(after).describe()["codes"].endswith("bytes per texel")


def test_changed_codes_are_written_as_they_are(path: Path, tmp_path: Path) -> None:
    changed = replace(load_latent_map(path), codes=latent().codes)
    assert changed.rated is None
    save_latent_map(changed, tmp_path / "b.safetensors")
    np.testing.assert_array_equal(load_latent_map(tmp_path / "b.safetensors").codes, changed.codes)


def test_tiles_are_read_alone(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = load_latent_map(path).rated
    assert found is not None
    assert len(found.tiles) == 2
    rows, columns = found.tiles[1]
    start = int(found.lengths[0, 0])
    harmed = found.stream.copy()
    harmed[:start] = 0
    np.testing.assert_array_equal(
        replace(found, stream=harmed).tile_codes(1), found.codes[rows, columns]
    )


def test_the_first_bytes_are_a_coarse_picture(path: Path, tmp_path: Path) -> None:
    whole = load_latent_map(path)
    assert whole.rated is not None
    data, sizes = path.read_bytes(), whole.rated.lengths.sum(axis=1)
    losses = []
    for levels in range(1, len(sizes) + 1):
        cut = tmp_path / "cut.safetensors"
        cut.write_bytes(data[: len(data) - int(sizes[levels:].sum())])
        losses.append(loss(load_latent_map(cut, levels), latent()))
        if levels < len(sizes):
            with pytest.raises(FormatError, match="cut short"):
                load_latent_map(cut)
            with pytest.raises(FormatError, match="cut short"):
                load_latent_map(cut, levels + 1)
    assert losses == sorted(losses, reverse=True)
    assert losses[-1] == pytest.approx(loss(whole, latent()))
    coarse = load_latent_map(path, 3)
    save_latent_map(coarse, cut)
    np.testing.assert_array_equal(load_latent_map(cut).codes, coarse.codes)


def test_levels_are_for_codes_at_a_rate(tmp_path: Path) -> None:
    save_latent_map(latent(), tmp_path / "plain.safetensors")
    with pytest.raises(FormatError, match="no levels"):
        load_latent_map(tmp_path / "plain.safetensors", 2)


@pytest.mark.parametrize("name", ["stream", "lengths", "axes", "steps", "scale", "center"])
def test_a_part_that_is_missing_or_damaged_is_told(path: Path, name: str) -> None:
    header, tensors = header_and_tensors(path)
    whole = tensors.pop(f"codes.{name}")
    rewrite(path, header, tensors)
    with pytest.raises(FormatError, match="felt"):
        load_latent_map(path)
    for odd in (whole[:-1], whole.astype("f8"), whole[None], np.concatenate([whole, whole])):
        rewrite(path, header, tensors | {f"codes.{name}": odd})
        with pytest.raises(FormatError, match="felt"):
            load_latent_map(path)
    if whole.dtype == np.uint8:
        odd = whole.copy()
        odd[len(odd) // 2] ^= 1
        rewrite(path, header, tensors | {f"codes.{name}": odd})
        with pytest.raises(FormatError, match=r"felt.*damaged"):
            load_latent_map(path)


@pytest.mark.parametrize(
    "change",
    [
        {"height": 0}, {"height": 1 << 40}, {"width": 149.0}, {"width": True}, {"tile": 0},
        {"tile": 1 << 20}, {"tile": 64}, {"crc32": 5}, {"crc32": []}, {"height": "70"},
    ],
)  # fmt: skip
def test_odd_numbers_are_told(path: Path, change: dict) -> None:
    header, tensors = header_and_tensors(path)
    header["codes"] |= change
    rewrite(path, header, tensors)
    with pytest.raises(FormatError, match="felt"):
        load_latent_map(path)


def test_coefficients_say_more_than_codes() -> None:
    short = latent()
    codec, random = short.codec, np.random.default_rng(3)
    expanded = codec.expanded()
    assert expanded is not None
    assert codec.expanded_dim == expanded.code_dim == 14
    coefficients = codec.decode(short.codes.reshape(-1, 6))
    assert codec.shortened(coefficients) == pytest.approx(short.codes.reshape(-1, 6), abs=0.05)
    coefficients += 0.05 * random.normal(size=coefficients.shape).astype(np.float32)
    whole = replace(short, codes=coefficients.reshape(70, 150, 14), codec=expanded)
    many = rated(whole, codec, Rate(20.0))
    assert many.codec is expanded
    seen = expanded.embedding(*BONN.pairs())
    left = seen(many.codes.reshape(-1, 14)) - seen(coefficients)
    alone = seen(codec.decode(codec.shortened(coefficients))) - seen(coefficients)
    assert np.square(left).mean() < 0.2 * np.square(alone).mean()


def test_a_codec_beside_may_be_expanded(tmp_path: Path) -> None:
    short = latent()
    save_codec(short.codec, tmp_path / "model.safetensors")
    expanded = short.codec.expanded()
    coefficients = short.codec.decode(short.codes.reshape(-1, 6)).reshape(70, 150, 14)
    sha256 = digest(tmp_path / "model.safetensors")
    reference = CodecFile("model.safetensors", sha256, expanded=True)
    before = limited(
        replace(short, codes=coefficients, codec=expanded, reference=reference), Rate(8.0)
    )
    save_latent_map(before, tmp_path / "a.safetensors")
    after = load_latent_map(tmp_path / "a.safetensors")
    assert after.reference == reference
    np.testing.assert_array_equal(after.codes, before.codes)
    everything = slice(0, 50)
    np.testing.assert_array_equal(
        NeuralBtf(after).texels(everything), NeuralBtf(before).texels(everything)
    )


def test_the_error_of_a_recoded_texture_is_estimated() -> None:
    before = latent()
    found = recoded(before, Rate(2.0))
    lost = 1e4 * found.loss.mse
    errors = found.latent.metadata["errors"]
    assert errors == {"MSE x 1e4": pytest.approx(2.5 + lost), "estimated": True}
    shown, truth = (NeuralBtf(m).texels(slice(None)) for m in (found.latent, before))
    assert 1e4 * np.square(shown - truth).mean() == pytest.approx(lost, rel=0.1)
    assert "MSE x 1e4 (estimated)" in NeuralBtf(found.latent).describe()


def test_a_large_map_is_tried_in_part(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("nacre.textures.limit.TILE", 16)
    found = limited(latent(), Rate(4.0))
    assert found.rated is not None
    assert len(found.rated.tiles) == 50
    assert 3.8 < found.rated.bytes_per_texel <= 4.0


def test_codes_and_coefficients_are_blended_and_compared(tmp_path: Path) -> None:
    short = latent(20, 30)
    whole = short.expanded()
    assert whole is not None
    mask = np.tile(np.linspace(0.0, 1.0, 30, dtype=np.float32), (20, 1))
    mixed = blend(short, whole, mask, keep_contrast=False)
    assert mixed.codes == pytest.approx(whole.codes, abs=1e-5)
    paths = [tmp_path / "short.safetensors", tmp_path / "whole.safetensors"]
    for made, path in zip((short, whole), paths, strict=True):
        save_latent_map(made, path)
    one, two = load_latent_maps(paths)
    np.testing.assert_array_equal(one.codes, two.codes)
