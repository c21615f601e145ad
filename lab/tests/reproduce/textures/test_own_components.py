"""Components of one texture against a singular value decomposition."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.btf import TableBtf
from nacre_lab.reproduce.textures.own_components import own_components
from tests.textures.codecs.principal.test_components import RING, TEXTURES, VALUES
from tests.textures.support import ByImage


def test_all_pairs_give_the_projection():
    codec = own_components(TEXTURES[0](), VALUES)
    texels = TEXTURES[0]().texels(slice(None))
    centred = texels.reshape(len(texels), -1) - codec.mean.reshape(-1)
    flat = codec.components.reshape(VALUES, -1)
    codes = codec.encoder(*RING)(texels)
    np.testing.assert_allclose(codes, centred @ flat.T, rtol=0.03, atol=2e-3)  # the ridge
    found = codec.decoder(*RING)(codes)
    error = np.square(found - texels).mean()
    singular = np.linalg.svd(centred, compute_uv=False) ** 2
    assert error <= 1.02 * singular[VALUES:].sum() / texels.size
    assert (found >= 0.0).all()


def test_components_are_eigenvectors():
    texture = TEXTURES[0]()
    codec = own_components(texture, VALUES)
    rows = texture.texels(slice(None)).reshape(texture.texel_count, -1).astype(np.float64)
    mean = rows.mean(axis=0)
    exact = np.linalg.eigvalsh((rows - mean).T @ (rows - mean) / len(rows))[::-1]
    np.testing.assert_allclose(codec.mean.reshape(-1), mean, atol=1e-5)
    np.testing.assert_allclose(codec.variances, exact[:VALUES], rtol=1e-3)
    flat = codec.components.reshape(VALUES, -1).astype(np.float64)
    np.testing.assert_allclose(flat @ flat.T, np.eye(VALUES), atol=1e-4)
    left = exact[VALUES:].sum() / rows.shape[1]
    assert codec.noise == pytest.approx(left, rel=2e-3, abs=1e-7)


def test_there_are_no_more_than_values_and_images_are_read_once():
    made = TEXTURES[0]()
    six = TableBtf(made.values[:, :, :6], made.wi[:6], made.wo[:6], "six")
    assert own_components(six, 19).code_dim == 18
    images = ByImage(made)
    own_components(images, 4)
    assert sorted(images.read) == list(range(len(RING[0])))
