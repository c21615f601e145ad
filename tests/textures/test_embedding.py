"""Distances between texels as they look."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.array import Floats
from nacre.measured.textures import BONN
from nacre.textures import LatentMap
from nacre.textures.codecs.codec import TexelCodec, TexelMap
from nacre.textures.embedding import nearest_texels
from tests.textures.codecs.basis.made import codec


def test_distances_are_those_of_roots_of_reflectance() -> None:
    made = codec()
    codes = 0.05 * np.random.default_rng(0).normal(size=(3, 2)).astype(np.float32)
    placed = made.embedding(*BONN.pairs())(codes)
    found = np.linalg.norm(placed[:, None] - placed, axis=2)
    roots = np.sqrt(made.decoder(*BONN.pairs())(codes))
    assert roots.min() > 0.0  # nothing was cut off
    expected = np.sqrt(np.square(roots[:, None] - roots).mean((2, 3)))
    np.testing.assert_allclose(found, expected, rtol=1e-3, atol=1e-6)


def test_of_other_codecs_they_are_nearly_so() -> None:
    class Plain(TexelCodec):
        """Codes are roots of reflectance that is the same at all directions."""

        code_dim = 3

        def encoder(self, wi: Floats, wo: Floats) -> TexelMap:
            return lambda texels: np.sqrt(texels.mean(1))

        def decoder(self, wi: Floats, wo: Floats) -> TexelMap:
            return lambda codes: np.repeat(np.square(codes)[:, None], len(wi), 1)

    placed = Plain().embedding(*BONN.pairs())(
        np.array([[0.2, 0.4, 0.6], [0.5, 0.4, 0.2]], np.float32)
    )
    assert np.linalg.norm(placed[0] - placed[1]) == pytest.approx((0.25 / 3) ** 0.5, rel=1e-5)


def test_the_nearest_texels_are_found_in_all_textures() -> None:
    made = codec()
    random = np.random.default_rng(3)
    wi, wo = (w[:2] for w in BONN.pairs())
    first, second = random.normal(size=(2, 4, 5, 2)).astype(np.float32)
    code = first[1, 2]
    second[3, 0] = code + np.float32(1e-3)
    maps = [LatentMap(codes, made, wi, wo) for codes in (first, second)]
    found = nearest_texels(code, maps, 3, leave_out=(0, 7))
    assert (found[0].texture, found[0].texel) == (1, 15)
    assert [n.distance for n in found] == sorted(n.distance for n in found)
    place = made.embedding(*BONN.pairs())
    every = [
        np.linalg.norm(place(m.codes.reshape(-1, 2)) - place(code[None]), axis=1) for m in maps
    ]
    every[0][7] = np.inf
    expected = np.sort(np.concatenate(every))[:3]
    assert [n.distance for n in found] == pytest.approx(expected.tolist(), rel=1e-5)
    (near, far) = nearest_texels(code, maps, 9, one_each=True)
    assert {near.texture, far.texture} == {0, 1}
    assert near.distance < 1e-6  # the texel itself, which is not left out here
