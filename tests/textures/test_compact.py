"""Compact codes, as files may hold them: what they stand for, and files that are damaged."""

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


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A file as nacre 0.2 wrote them."""
    path = tmp_path / "felt.safetensors"
    random = np.random.default_rng(4)
    plain = np.zeros((30, 40, 20), np.float32)
    save_latent_map(LatentMap(plain, codec(sizes=SIZES), *UTIA.pairs()), path)
    header, tensors = header_and_tensors(path)
    tensors["codes"] = random.integers(256, size=(30, 40, 16), dtype=np.uint8)
    tensors["codes.axes"] = random.normal(size=(20, 20)).astype(np.float32)
    tensors["codes.center"] = random.normal(size=20).astype(np.float32)
    rewrite(path, header, tensors)
    return path


def test_files_of_old_are_read(path: Path) -> None:
    """12 bytes, then 8 halves, upper ones first."""
    _, tensors = header_and_tensors(path)
    places = tensors["codes"].astype(int)
    halves = np.stack([places[..., 12:] // 16, places[..., 12:] % 16], -1).reshape(30, 40, 8)
    numbers = np.concatenate([places[..., :12], halves], -1)
    wanted = numbers @ tensors["codes.axes"].astype(float) + tensors["codes.center"]
    after = load_latent_map(path).codes
    assert after.dtype == np.float32
    assert after == pytest.approx(wanted, abs=2e-3)


def test_numbers_are_what_the_format_says() -> None:
    """A byte, then upper and lower halves of one: 200 a + 7 b + 12 c about the center."""
    axes = np.diag(np.array([1.0, 10.0, 100.0], np.float32))
    found = CompactCodes(np.array([[[200, 7 * 16 + 12]]], np.uint8), axes, np.float32([1, 2, 3]))
    assert found.codes.tolist() == [[[201.0, 72.0, 1203.0]]]


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
