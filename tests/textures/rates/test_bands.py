"""The coder of whole numbers: what is written is read, in about as few bits as the entropy."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.textures.rates.bands import (
    LARGEST,
    decode_bands,
    decode_table,
    encode_bands,
    encode_table,
)
from nacre.textures.rates.wavelet import band_shapes


def numbers(channels: int, shape: tuple[int, int], scale: float) -> list[list[np.ndarray]]:
    random = np.random.default_rng(7)
    return [
        [np.round(random.laplace(0.0, scale, (channels, *s))).astype(np.int32) for s in level]
        for level in band_shapes(*shape, 3)
    ]


@pytest.mark.parametrize("shape", [(37, 50), (1, 1), (1, 7), (64, 3)])
@pytest.mark.parametrize("scale", [0.0, 0.1, 2.0, 1e3, 1e6])
def test_what_is_written_is_read(shape: tuple[int, int], scale: float) -> None:
    before = [[b.clip(-LARGEST, LARGEST) for b in level] for level in numbers(3, shape, scale)]
    chunks = encode_bands(before)
    after = decode_bands(chunks, 3, band_shapes(*shape, 3))
    for level, again in zip(before, after, strict=True):
        for band, found in zip(level, again, strict=True):
            np.testing.assert_array_equal(found, band)
    if scale == 0.0:
        assert not any(chunks)


def test_the_largest_numbers_are_read() -> None:
    table = np.array([[LARGEST, -LARGEST, 0], [1, -1, LARGEST]], np.int32)
    np.testing.assert_array_equal(decode_table(encode_table(table), (2, 3)), table)


@pytest.mark.parametrize("scale", [0.2, 1.0, 8.0])
def test_bits_are_about_those_of_the_entropy(scale: float) -> None:
    bands = numbers(4, (96, 96), scale)
    every = np.concatenate([band.ravel() for level in bands for band in level])
    shares = np.unique(every, return_counts=True)[1] / len(every)
    entropy = -float((shares * np.log2(shares)).sum()) * len(every) / 8
    assert 0.98 * entropy < sum(map(len, encode_bands(bands))) < 1.06 * entropy


def test_neighbors_that_are_alike_take_fewer_bits() -> None:
    random = np.random.default_rng(7)
    loud = np.repeat(np.repeat(random.random((1, 12, 12)) < 0.2, 8, 1), 8, 2)
    grouped = np.round(random.normal(size=loud.shape) * np.where(loud, 20.0, 0.3)).astype(np.int32)
    mixed = random.permutation(grouped.ravel()).reshape(grouped.shape)
    sizes = [len(encode_bands([[band]])[0]) for band in (grouped, mixed)]
    assert sizes[0] < 0.85 * sizes[1]


def test_damage_gives_numbers_and_no_error() -> None:
    chunks = encode_bands(numbers(3, (37, 50), 5.0))
    random = np.random.default_rng(1)
    for _ in range(20):
        damaged = [bytes(random.integers(256, size=len(chunk), dtype=np.uint8)) for chunk in chunks]
        for level in decode_bands(damaged, 3, band_shapes(37, 50, 3)):
            assert all(np.abs(band).max(initial=0) <= 2 * LARGEST for band in level)
