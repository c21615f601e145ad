"""Compact codes: what is lost, files of them, and files that are damaged."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from nacre.errors import FormatError
from nacre.measured.textures import UTIA
from nacre.textures import LatentMap, load_latent_map, save_latent_map
from nacre.textures.codecs.basis import BasisRecipe
from nacre.textures.compact import CompactCodes
from tests.textures.codec_files import header_and_tensors, rewrite
from tests.textures.codecs.basis.made import codec

SIZES = BasisRecipe(
    code_dim=20, luma_count=20, chroma_count=6, width=6, depth=2, wide=8, hidden=5, completing=7
)


def codes() -> np.ndarray:
    """Of 20 values, of which some vary a hundred times as much as others, turned."""
    random = np.random.default_rng(4)
    turn, _ = np.linalg.qr(random.normal(size=(20, 20)))
    places = random.normal(size=(30, 40, 20)) * np.geomspace(1.0, 0.01, 20)
    return np.asarray(3.0 + places @ turn, np.float32)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "felt.safetensors"
    save_latent_map(LatentMap(codes(), codec(sizes=SIZES), *UTIA.pairs()), path, compact=True)
    return path


def test_half_a_byte_for_most_loses_little(path: Path) -> None:
    before, model = codes(), codec(sizes=SIZES)
    after = load_latent_map(path).codes
    assert after.dtype == np.float32
    assert after.shape == before.shape
    lost = (after - before).var() / (before - before.mean((0, 1))).var()
    assert 0.0 < lost < 1e-3
    wi, wo = (w[::97] for w in UTIA.pairs())
    shown, wanted = (model.decoder(wi, wo)(c.reshape(-1, 20)) for c in (after, before))
    assert np.square(shown - wanted).mean() < 2e-3 * wanted.var()


def test_a_file_has_the_bytes_that_it_should(path: Path, tmp_path: Path) -> None:
    _, tensors = header_and_tensors(path)
    assert (tensors["codes"].dtype, tensors["codes"].shape) == (np.uint8, (30, 40, 12 + 4))
    again = tmp_path / "again.safetensors"
    save_latent_map(LatentMap(codes(), codec(sizes=SIZES), *UTIA.pairs()), again, compact=True)
    assert again.read_bytes() == path.read_bytes()


def test_numbers_are_what_the_format_says() -> None:
    """A byte, then upper and lower halves of one: 200 a + 7 b + 12 c about the center."""
    axes = np.diag(np.array([1.0, 10.0, 100.0], np.float32))
    found = CompactCodes(np.array([[[200, 7 * 16 + 12]]], np.uint8), axes, np.float32([1, 2, 3]))
    assert found.codes.tolist() == [[[201.0, 72.0, 1203.0]]]


@pytest.mark.parametrize("dim", [1, 12, 13, 21])
def test_codes_of_any_size_and_of_one_color(dim: int) -> None:
    sizes = BasisRecipe(
        code_dim=dim, luma_count=20, chroma_count=6, width=6, depth=2, wide=8, hidden=5,
        completing=7,
    )  # fmt: skip
    flat = np.full((4, 3, dim), 0.25, np.float32)
    found = CompactCodes.of(flat, codec(sizes=sizes))
    assert found.codes == pytest.approx(flat, abs=1e-5)
    assert len(found.axes) == dim


@pytest.mark.parametrize(
    "change",
    [
        {"codes.axes": np.eye(19, dtype="f4")},
        {"codes.axes": np.full((20, 20), np.nan, "f4")},
        {"codes.axes": np.full((20, 20), 1e38, "f4")},
        {"codes.axes": np.eye(20)},
        {"codes.center": np.zeros((20, 1), "f4")},
        {"codes.center": np.zeros(40, "f4"), "codes.axes": np.zeros((40, 40), "f4")},
        {"codes": np.zeros((30, 40), "u1")},
        {"codes": np.zeros((0, 40, 16), "u1")},
        {"codes": np.zeros((30, 40, 9), "u1")},
        {"codes": np.zeros((30, 40, 21), "u1")},
        {"codes": np.zeros((30, 40, 20), "i1")},
    ],
)
def test_damaged_files_are_refused(path: Path, change: dict[str, np.ndarray]) -> None:
    header, tensors = header_and_tensors(path)
    rewrite(path, header, tensors | change)
    with pytest.raises(FormatError, match="felt"):
        load_latent_map(path)


@pytest.mark.parametrize("name", ["codes.axes", "codes.center"])
def test_a_part_that_is_missing_is_told(path: Path, name: str) -> None:
    header, tensors = header_and_tensors(path)
    rewrite(path, header, {key: value for key, value in tensors.items() if key != name})
    with pytest.raises(FormatError, match="felt"):
        load_latent_map(path)
