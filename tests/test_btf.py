"""The interface of textures, on one that lies in memory."""

import numpy as np
import pytest

from nacre.btf import Btf, TableBtf
from nacre.measured.textures import UTIA
from nacre.measured.textures.domes import below


@pytest.fixture
def texture() -> TableBtf:
    wi, wo = UTIA.pairs()
    values = np.random.default_rng(0).random((3, 5, len(wi), 3)).astype(np.float16)
    return TableBtf(values, wi, wo)


def test_texels_and_images_are_the_same_values(texture: TableBtf) -> None:
    texels = texture.texels(np.array([7, 3]))
    images = texture.images(np.array([11, 4000]))
    assert texels.dtype == images.dtype == np.float32
    assert np.array_equal(texels[0, [11, 4000]], images[:, 1, 2])
    assert np.array_equal(texels[1, [11, 4000]], images[:, 0, 3])


def test_texels_at_some_pairs_are_those_of_all(texture: TableBtf) -> None:
    chosen, pairs = np.array([7, 3, 7]), np.array([0, 11, 4000])
    expected = texture.texels(chosen)[:, pairs]
    found = texture.texels_at(chosen, pairs)
    assert found.dtype == np.float32
    assert np.array_equal(found, expected)
    assert np.array_equal(Btf.texels_at(texture, chosen, pairs), expected)


def test_blocks_cover_every_texel_once(texture: TableBtf) -> None:
    limit = 4 * 12 * texture.pair_count
    blocks = list(texture.blocks(limit))
    assert [b.start for b in blocks] == [0, 4, 8, 12]
    assert blocks[-1].stop == texture.texel_count
    assert list(texture.blocks(limit, 5, 11)) == [slice(5, 9), slice(9, 11)]


def test_a_table_of_another_shape_is_refused(texture: TableBtf) -> None:
    with pytest.raises(ValueError, match="do not fit"):
        TableBtf(texture.values, texture.wi[:-1], texture.wo[:-1])


def test_directions_within_an_angle() -> None:
    assert below(UTIA.directions, 45.0).sum() == 37
