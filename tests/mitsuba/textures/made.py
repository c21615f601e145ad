"""Textures that the tests of rendering share, and interactions with them."""

from __future__ import annotations

from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.btf import TableBtf
from nacre.io.tensors import Tensors
from nacre.measured.textures import BONN
from nacre.textures.codecs.codec import TexelCodec, TexelMap
from nacre.textures.latent_map import LatentMap

FLIP = np.array([1.0, -1.0, 1.0], np.float32)
"""From directions of a texture to those of a surface whose v runs along its second axis."""


class FlatCodec(TexelCodec):
    """Three values a texel, which are its diffuse color."""

    kind = "flat"
    code_dim = 3

    def encoder(self, wi: Floats, wo: Floats) -> TexelMap:
        """The mean color."""
        return lambda texels: texels.mean(1)

    def decoder(self, wi: Floats, wo: Floats) -> TexelMap:
        """The code, whatever the directions."""
        return lambda codes: np.repeat(np.asarray(codes)[:, None], len(wi), 1)

    def pack(self, precision: str | None = "single") -> tuple[dict[str, Any], Tensors]:
        """Nothing needs it in a file."""
        raise NotImplementedError

    @classmethod
    def unpack(cls, header: dict[str, Any], tensors: Tensors) -> FlatCodec:
        """Nothing needs it in a file."""
        raise NotImplementedError


def latent(codes: Floats, codec: TexelCodec, name: str = "cloth") -> LatentMap:
    """A map of codes of a texture of one pair of directions."""
    up = np.array([[0.0, 0.0, 1.0]], np.float32)
    return LatentMap(np.asarray(codes, np.float32), codec, up, up, name)


def picture(pixels: Floats) -> TableBtf:
    """A texture with the same picture at every light and view of a small dome."""
    directions = BONN.directions[:19]
    wi, wo = np.tile(directions, (19, 1)), np.repeat(directions, 19, 0)
    values = np.repeat(np.asarray(pixels, np.float32)[:, :, None], len(wi), 2)
    return TableBtf(values, wi, wo, "picture")


def hemisphere(count: int, seed: int, lowest: float = 0.15) -> Floats:
    """Random directions above a cosine."""
    random = np.random.default_rng(seed)
    z, phi = random.uniform(lowest, 1.0, count), random.uniform(0.0, 2.0 * np.pi, count)
    radius = np.sqrt(1.0 - z * z)
    return np.stack([radius * np.cos(phi), radius * np.sin(phi), z], -1).astype(np.float32)


def hits(mi: Any, uv: Floats, wo: Floats) -> Any:
    """Interactions on the plane z = 0 with v along y; directions are of the texture."""
    import drjit as dr

    si = dr.zeros(mi.SurfaceInteraction3f, len(uv))
    si.uv = mi.Point2f(np.ascontiguousarray(np.asarray(uv, np.float32).T))
    si.wi = surface(mi, wo)
    si.n, si.sh_frame = mi.Normal3f(0, 0, 1), mi.Frame3f(mi.Vector3f(0, 0, 1))
    si.dp_du, si.dp_dv = si.sh_frame.s, si.sh_frame.t
    return si


def surface(mi: Any, w: Floats) -> Any:
    """Directions of the texture as those of the surface of :func:`hits`."""
    return mi.Vector3f(np.ascontiguousarray((w * FLIP).T))


def centres(texels: Any, height: int, width: int) -> Floats:
    """Texture coordinates of the middles of texels y * width + x."""
    y, x = np.divmod(np.asarray(texels), width)
    return np.stack([(x + 0.5) / width, (y + 0.5) / height], -1)


def factors_at(mi: Any, bsdf: Any, uv: Floats, wi: Floats, wo: Floats) -> Floats:
    """Reflectance factors that a BSDF has, shape (n, 3)."""
    value = bsdf.eval(mi.BSDFContext(), hits(mi, uv, wo), surface(mi, wi))
    return np.pi * np.array(value).T / wi[:, 2:]
