"""A small texture that the tests of exports share."""

from __future__ import annotations

from functools import cache

import numpy as np

from nacre.array import Floats
from nacre.geometry import half_vector, join, split
from nacre.measured.textures import BONN
from nacre.targets.textures import HeightField, TextureAtlas
from nacre.textures.codecs import load_codec
from nacre.textures.latent_map import LatentMap, NeuralBtf

HEIGHT, WIDTH, RESOLUTION = 5, 7, 6
NAME = "cloth"


@cache
def texture() -> NeuralBtf:
    """Gloss of several tilts over several colors, encoded by the default codec."""
    directions = BONN.directions[::4]
    count = len(directions)
    wi, wo = np.tile(directions, (count, 1)), np.repeat(directions, count, 0)
    random = np.random.default_rng(5)
    half = join(half_vector(split(wi), split(wo)))
    normals = np.concatenate([random.normal(0.0, 0.2, (HEIGHT * WIDTH, 2)), np.ones((35, 1))], 1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    gloss = np.maximum(normals @ half.T, 0.0) ** 40.0
    colors = random.uniform(0.02, 0.5, (HEIGHT * WIDTH, 1, 3))
    values = np.asarray(colors + 0.6 * gloss[:, :, None], np.float32)
    codec = load_codec("basis")
    codes = codec.encoder(wi, wo)(values).reshape(HEIGHT, WIDTH, -1)
    return NeuralBtf(LatentMap(codes, codec, wi, wo, NAME))


@cache
def heights() -> HeightField:
    """Hills over the texture, of another number of pixels."""
    random: Floats = np.random.default_rng(2).random((9, 12))
    return HeightField(random, 0.08)


@cache
def atlas() -> TextureAtlas:
    """With a coarse grid of directions."""
    return TextureAtlas.of(texture(), RESOLUTION, heights())
