"""A texture under a moving light, measured or decoded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from nacre.btf import Btf
from nacre.runtime.progress import Progress, silent
from nacre.textures.codecs.codec import TexelCodec
from nacre.textures.latent_map import NeuralBtf
from nacre.workflows.texture_rendering import TextureView, texture_pictures
from nacre_lab.reproduce.textures.rendering import decoder_at_hits, encoded


def animation(
    texture: Btf,
    codec: TexelCodec | None,
    view: TextureView,
    seed: int,
    progress: Progress = silent,
) -> npt.NDArray[np.float16]:
    """Frames of a texture, encoded and decoded at hits if a codec is given.

    The papers' networks are evaluated at every hit, other codecs tabulated.

    Parameters
    ----------
    texture, codec
        The texture, and the codec or None.
    view
        The view; its `frames` is not None.
    seed
        Seed of the samples.

    Returns
    -------
    array of shape (frames, size, size, 3)
        Linear RGB, clipped to [0, 1].

    Raises
    ------
    NacreError
        If the codec is for other directions, or decodes only its own.
    MissingExtraError
        If the renderer is not installed.
    """
    shown, view = texture, replace(view, seed=seed)
    if codec is not None:
        shown = NeuralBtf(encoded(texture, codec, progress))
        view = replace(view, decoder=decoder_at_hits(codec))
    return np.stack(list(texture_pictures(shown, view, progress))).astype(np.float16)
