"""The texture network of 2019 on one reflectance: Figure 2 of the NBRDF paper."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from nacre.brdf import Brdf
from nacre.measured.textures.domes import BONN
from nacre.runtime.device import one_thread
from nacre.textures.codecs.codec import CODECS, TrainingRun
from nacre.textures.uniform import TexelBrdf, tile

STEPS = 20
"""Steps of the training for each epoch of the other networks."""
TRAINING: Mapping[str, Any] = {"loss_directions": 2048, "held_out": 0.0}
"""Settings of the training besides those of the network; there is only one texel."""


class TextureNetworkBrdf(TexelBrdf):
    """A reflectance as a code and a decoder of its own."""

    @property
    def nbytes(self) -> int:
        """Bytes of the code and of the decoder; the encoder is not needed any more."""
        layers = self.codec.hit_layers()  # type: ignore[attr-defined]
        weights = sum(layer.weights.nbytes + layer.biases.nbytes for layer in layers)
        return int(self.code.nbytes + weights)


def fit_texture_network(brdf: Brdf, *, epochs: int, seed: int) -> TextureNetworkBrdf:
    """Train encoder and decoder of Rainer et al. 2019 on one reflectance alone.

    It is treated as a uniform texture, measured like those in their paper: at each pair of the 151
    directions of the Bonn dome, up to 75 degrees. The decoder inter- and extrapolates. The loss is
    theirs, squared errors of whitened logarithms.

    Parameters
    ----------
    brdf
        Any reflectance.
    epochs
        Length of the training: :data:`STEPS` steps each.
    seed
        Seed of the first weights, and of the pairs compared in a step.

    Raises
    ------
    MissingExtraError
        If PyTorch is not installed.
    NacreError
        If the training diverges.
    """
    wi, wo = BONN.pairs()
    texture, kind = tile(brdf, wi, wo), CODECS["custom"]
    recipe = kind.recipe(steps=STEPS * epochs, batch=1, seed=seed)
    recipe = replace(recipe, training=replace(recipe.training, **TRAINING))
    with one_thread():
        codec = kind.train(TrainingRun([Path(brdf.name)], lambda _: texture), recipe)
    code = codec.encoder(wi, wo)(texture.texels(np.array([0])))[0]
    return TextureNetworkBrdf(code, codec, brdf.name)
