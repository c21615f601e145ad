"""One material of a texture, and a texture of one material."""

from __future__ import annotations

import math

import numpy as np

from nacre.array import Components, Floats
from nacre.brdf import Brdf
from nacre.btf import Btf, TableBtf
from nacre.geometry import join, split
from nacre.runtime.progress import Progress, silent
from nacre.textures.codecs.codec import TexelCodec
from nacre.textures.latent_map import LatentMap

_BLOCK = 1 << 25  # bytes of values that are read at a time


def average(texture: Btf, progress: Progress = silent) -> TableBtf:
    """The mean apparent BRDF of a texture, as a texture of one texel: as it is seen from afar.

    All of the texture is read, a part at a time. Progress is called with texels, or with images
    where values lie in images.
    """
    total = np.zeros((texture.pair_count, 3))
    if texture.by_image:
        step = max(1, _BLOCK // (12 * texture.texel_count))
        for start in range(0, texture.pair_count, step):
            part = slice(start, min(start + step, texture.pair_count))
            total[part] = texture.images(part).mean((1, 2), np.float64)
            progress("reading", part.stop, texture.pair_count, "")
    else:
        for block in texture.blocks(_BLOCK):
            total += texture.texels(block).sum(0, np.float64)
            progress("reading", block.stop, texture.texel_count, "")
        total /= texture.texel_count
    values = total.astype(np.float32)[None, None]
    return TableBtf(values, texture.wi, texture.wo, texture.name)


def tile(material: Brdf, wi: Floats, wo: Floats, width: int = 1, height: int = 1) -> TableBtf:
    """A texture that has one material everywhere; it takes the memory of one texel.

    `wi` and `wo` are the texture's unit directions, shape (n, 3); width and height are in texels. A
    ValueError says that a size is not positive.
    """
    if min(width, height) < 1:
        raise ValueError(f"{width} x {height} texels, expected at least 1 x 1")
    values = (math.pi * material.eval(wi, wo)).astype(np.float32)
    shape = (height, width, *values.shape)
    return TableBtf(np.broadcast_to(values, shape), wi, wo, material.name)


class TexelBrdf(Brdf):
    """The apparent BRDF of a single code, shape (values,), wherever its codec can decode.

    Unlike the BRDF of a surface, a texel's includes shadows and what parallax brings into view: it
    need not be reciprocal, and it changes when the texel is rotated about the normal.
    """

    isotropic = False
    traceable = False

    def __init__(self, code: Floats, codec: TexelCodec, name: str = "") -> None:
        super().__init__(name=name)
        self.code, self.codec = np.asarray(code, np.float32), codec

    @property
    def nbytes(self) -> int:
        """Bytes of the code; its codec serves many materials."""
        return int(self.code.nbytes)

    def latent(self) -> LatentMap:
        """As an encoded texture of one texel; see :func:`material_of`."""
        up = np.array([[0.0, 0.0, 1.0]], np.float32)
        return LatentMap(self.code[None, None], self.codec, up, up, self.name)

    def eval_components(self, wi: Components, wo: Components) -> Components:
        light, view = (np.ascontiguousarray(join(w), np.float32) for w in (wi, wo))
        return split(self.codec.decoder(light, view)(self.code[None])[0] / np.float32(math.pi))


def material_of(latent: LatentMap) -> TexelBrdf:
    """The material of an encoded texture of one texel.

    Raises a ValueError if it has more, or its codec decodes at its own directions only.
    """
    height, width, _ = latent.shape
    if (height, width) != (1, 1):
        raise ValueError(f"is a texture of {width} x {height} texels, not one material")
    material = TexelBrdf(latent.codes[0, 0], latent.codec, latent.name)
    material.eval([0.6, 0.0, 0.8], [0.0, 0.0, 1.0])
    return material
