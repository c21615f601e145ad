"""Mixtures of two materials, texel by texel, as mixtures of their codes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.ndimage import gaussian_filter, map_coordinates

from nacre.array import Floats
from nacre.errors import FormatError, NacreError, did_you_mean, reason
from nacre.io.files import PathLike, first_bytes
from nacre.io.image_file import JPEG_MAGIC, PNG_MAGIC
from nacre.textures.alike import alike, same_codec
from nacre.textures.latent_map import LatentMap
from nacre.textures.synthesis.quilted_map import TEXEL_LIMIT

NAMED = ("right", "down", "noise")  # masks that are made rather than read

_PIXEL_LIMIT = 1 << 26
_GRAY = {"1": 1.0, "L": 255.0, "I;16": 65535.0, "I;16B": 65535.0}
"""Largest values of pixels, by Pillow's names of kinds of images."""
_COLORED = {"RGB", "RGBA", "LA"}
_SPOTS = 16  # of noise along an edge, about
_STEEP = 0.5  # of noise: standard deviations within which the mask goes from a half to an end


def named_mask(source: PathLike, height: int, width: int, seed: int = 0) -> Floats:
    """Fractions of the second material, 0 to 1, shape (height, width).

    The source is `right` or `down`, where a mask grows evenly; `noise`, smooth spots that tile, by
    a seed; or an image, which is stretched. For that and its errors see :func:`read_mask`.
    """
    if source == "noise":
        white = np.random.default_rng(seed).normal(size=(height, width))
        smooth = gaussian_filter(white, max(height, width) / (2 * _SPOTS), mode="wrap")
        standard = (smooth - smooth.mean()) / max(float(smooth.std()), 1e-9)
        return np.asarray(np.clip(0.5 + 0.5 * standard / _STEEP, 0.0, 1.0), np.float32)
    if source in ("right", "down"):
        rows, columns = np.linspace(0.0, 1.0, height), np.linspace(0.0, 1.0, width)
        ramp = columns[None] if source == "right" else rows[:, None]
        return np.broadcast_to(ramp, (height, width)).astype(np.float32)
    return _stretched(read_mask(source), height, width)


def read_mask(path: PathLike) -> Floats:
    """An image as fractions: black is 0 and white 1, without a display curve.

    It is PNG or JPEG, in grays with 1, 8 or 16 bits or in colors that are gray. Raises a
    FormatError if it cannot be read, is no such image, is colored or not opaque, or has too many
    pixels.
    """
    from PIL import Image

    path = Path(path)
    if not path.exists():
        hint = did_you_mean(str(path), NAMED)
        raise FormatError(f"{path}: is neither a file nor a named mask ({', '.join(NAMED)}){hint}")
    if not first_bytes(path).startswith((PNG_MAGIC, JPEG_MAGIC)):
        raise FormatError(f"{path}: a mask is a gray PNG or JPEG image")
    try:
        with Image.open(path, formats=["PNG", "JPEG"]) as image:
            mode, (width, height) = image.mode, image.size
            if width * height > _PIXEL_LIMIT:
                raise FormatError(
                    f"{path}: {width:,} x {height:,} pixels are more than the {_PIXEL_LIMIT:,} "
                    "that are read; make it smaller, it is stretched to the texture"
                )
            pixels = np.array(image)
    except FormatError:
        raise
    except Exception as error:  # the decoder meets damage in many ways
        raise FormatError(f"{path}: cannot be decoded: {reason(error)}") from error
    if mode in _GRAY:
        return pixels.astype(np.float32) / np.float32(_GRAY[mode])
    if mode not in _COLORED:
        raise FormatError(f"{path}: is of kind {mode}; save it as a gray image of 8 or 16 bits")
    return _gray(path, pixels, mode)


def _gray(path: Path, pixels: npt.NDArray[np.uint8], mode: str) -> Floats:
    colors = pixels[..., :3] if mode.startswith("RGB") else pixels[..., :1]
    if mode.endswith("A") and (pixels[..., -1] < 255).any():
        raise FormatError(f"{path}: is transparent in places; save the mask as an opaque image")
    if (np.ptp(colors, axis=-1) > 2).any():  # JPEG of gray colors is gray to a rounding
        raise FormatError(f"{path}: is colored, and a mask is gray; save it as one")
    return colors[..., 0].astype(np.float32) / np.float32(255.0)


def _stretched(mask: Floats, height: int, width: int) -> Floats:
    """The mask at the centers of that many texels, linear between its own."""
    sizes = zip((height, width), mask.shape, strict=True)
    rows, columns = ((np.arange(n) + 0.5) * size / n - 0.5 for n, size in sizes)
    where = np.meshgrid(rows, columns, indexing="ij")
    found: Floats = map_coordinates(mask, where, order=1, mode="nearest")
    return np.clip(found, 0.0, 1.0)


def blend(
    first: LatentMap, second: LatentMap, mask: Floats, *, keep_contrast: bool = True
) -> LatentMap:
    """A texture that goes from one material to another, where a mask of shape (height, width) goes
    from 0 to 1.

    Codes are weighted means (Rainer et al. 2020, section 5.2, on the stability of the space). Maps
    that are smaller than the mask repeat; synthesize a larger one first where that would show. With
    `keep_contrast`, deviations from each material's mean code, which are unlike and partly cancel
    in a mean, are made larger again by the root of the sum of the squared weights (Heitz and Neyret
    2018, "High-Performance By-Example Noise"). Without it the middle between two textures is hazy.

    Raises a NacreError if the codecs differ, or the mask is empty, too large, or has numbers
    outside of 0 to 1.
    """
    first, second = alike([first, second])
    if same_codec([first, second]) is not None:
        raise NacreError(
            f"{first.name or 'the first'} and {second.name or 'the second'} were encoded by "
            "different models, so that their codes do not mix; encode both by the same one"
        )
    if mask.ndim != 2 or not 0 < mask.size <= TEXEL_LIMIT:
        raise NacreError(f"a mask has 1 to {TEXEL_LIMIT:,} texels in rows, not {mask.shape}")
    if not ((mask >= 0.0) & (mask <= 1.0)).all():
        raise NacreError("values of a mask are numbers within 0 and 1")
    weights = np.asarray(mask, np.float32)[..., None]
    mixed = np.zeros((*mask.shape, first.codec.code_dim), np.float32)
    scale = np.ones_like(weights)
    if keep_contrast:
        scale /= np.sqrt(np.square(weights) + np.square(1.0 - weights))
    for latent, weight in ((first, 1.0 - weights), (second, weights)):
        mean = latent.codes.mean((0, 1), dtype=np.float64).astype(np.float32)
        mixed += weight * (mean + scale * (_repeated(latent, mask.shape) - mean))
    for latent, alone in ((first, mask == 0.0), (second, mask == 1.0)):
        mixed[alone] = _repeated(latent, mask.shape)[alone]  # free of rounding
    dtype = np.result_type(first.codes.dtype, second.codes.dtype)
    name = " to ".join(filter(None, (first.name, second.name)))
    return replace(first, codes=mixed.astype(dtype), name=name, metadata={})


def _repeated(latent: LatentMap, shape: tuple[int, ...]) -> Floats:
    """Its codes, tiled to a height and a width."""
    rows, columns = (np.arange(n) % m for n, m in zip(shape, latent.codes.shape[:2], strict=True))
    return latent.codes[np.ix_(rows, columns)].astype(np.float32)
