"""A texture as a folder of images, one a pair of directions."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf import Btf, Indices
from nacre.color import srgb_to_linear, xyz_to_rgb
from nacre.errors import FormatError
from nacre.io.files import read_bytes
from nacre.io.image_file import ImageHeader, decode, parse_header, read_header
from nacre.runtime.parallel import thread_map

Quantity: TypeAlias = Literal["reflectance", "radiance"]
"""What pixels hold: the reflectance factor, which is radiance over that of a white diffuse surface
under the same light; or radiance for a constant irradiance perpendicular to the beam, over that of
the white surface with the light at the normal. The second is the first times the cosine of the
light's polar angle."""

QUANTITIES: tuple[Quantity, ...] = get_args(Quantity)

_PIXEL_LIMIT = 1 << 24
_SIZE_LIMIT = 1 << 28  # bytes of a file: 16 a pixel
_CACHE_SIZE = 1 << 26  # bytes of pictures that are kept, or one picture
_CHANNELS = (frozenset("RGB"), frozenset("XYZ"))


class ImageFolderBtf(Btf):
    """Pictures that are decoded when they are asked for; the last few are kept.

    PNG and JPEG images follow the sRGB curve, whatever they say; OpenEXR images hold linear Rec.
    709 in R, G, B or CIE 1931 colors in X, Y, Z, where white is D65. :meth:`texels` decodes all of
    them at each call, which is slow: convert the folder first, or work on what
    :func:`nacre.measured.textures.transposition.transposed` gives.

    There is an image for each pair of unit directions above the horizon, `wi` and `wo`, shape (n,
    3). `quantities` say what its pixels hold, `scales` what their value 1 stands for; 1 where None.
    A FormatError says that an image cannot be read, is of no such kind, is too large, or of another
    size than the first. Pixels are read later, and damage to them is found then.
    """

    by_image = True

    def __init__(
        self,
        files: Sequence[Path],
        wi: Floats,
        wo: Floats,
        name: str,
        quantities: Sequence[Quantity],
        scales: Sequence[float] | None = None,
    ) -> None:
        self.files = list(files)
        radiance = np.array([quantity == "radiance" for quantity in quantities])
        self._radiance = int(radiance.sum())
        self._scales = np.where(radiance, 1.0 / wi[:, 2], 1.0).astype(np.float32)
        if scales is not None:
            self._scales *= np.asarray(scales, np.float32)
        self._first = read_header(self.files[0])
        width, height = self._first.width, self._first.height
        if min(width, height) < 1 or width * height > _PIXEL_LIMIT:
            raise FormatError(
                f"{self.files[0]}: has {width} x {height} pixels, expected 1 to {_PIXEL_LIMIT:,} "
                "in all; crop the images or scale them down"
            )
        super().__init__(width, height, wi, wo, name=name)
        for path in self.files:
            self._check(path, read_header(path))

    @functools.cached_property
    def _image(self) -> Callable[[int], npt.NDArray[np.float32]]:
        """A picture by its number; those of late are kept."""
        kept = max(1, _CACHE_SIZE // (12 * self.texel_count))
        return functools.lru_cache(kept)(self._decode)

    def describe(self) -> dict[str, Any]:
        first = self._first
        curve = f"sRGB, {first.bits} bits" if first.bits else "linear"
        return super().describe() | {
            "values": f"{curve}, {''.join(sorted(first.channels, key='RGBXYZ'.index))}",
            "images of radiance": self._radiance,
        }

    def texels(self, chosen: Indices | slice) -> Floats:
        """See :meth:`Btf.texels`: here all images are decoded, whatever is chosen."""
        count = len(np.arange(self.texel_count)[chosen])
        values = np.empty((count, self.pair_count, 3), np.float32)

        def fill(index: int) -> None:
            values[:, index] = self._image(index).reshape(-1, 3)[chosen]

        list(thread_map(fill, range(self.pair_count)))
        return values

    def images(self, chosen: Indices | slice) -> Floats:
        indices = np.arange(self.pair_count)[chosen]
        pictures = np.empty((len(indices), self.height, self.width, 3), np.float32)

        def fill(place: int) -> None:
            pictures[place] = self._image(int(indices[place]))

        list(thread_map(fill, range(len(indices))))
        return pictures

    def _check(self, path: Path, header: ImageHeader) -> None:
        if (header.width, header.height) != (self.width, self.height):
            raise FormatError(
                f"{path}: has {header.width} x {header.height} pixels, {self.files[0].name} has "
                f"{self.width} x {self.height}; all must be of one size"
            )
        if header.channels not in _CHANNELS:
            found = ", ".join(sorted(header.channels)) or "none"
            raise FormatError(f"{path}: has other channels than R, G, B or X, Y, Z: {found[:80]!a}")

    def _decode(self, index: int) -> npt.NDArray[np.float32]:
        path = self.files[index]
        data = read_bytes(path, _SIZE_LIMIT)
        header = parse_header(data, path)
        self._check(path, header)
        pixels = decode(data, header, path)
        with np.errstate(invalid="ignore", over="ignore"):  # said below, of the image
            if header.bits:
                values: npt.NDArray[np.float32] = _srgb_curve(header.bits)[pixels]
            elif "X" in header.channels:
                values = xyz_to_rgb(pixels).astype(np.float32)
            else:
                values = pixels.astype(np.float32)
            values *= self._scales[index]
        if not np.isfinite(values).all():
            raise FormatError(f"{path}: pixels: some are not finite; mend or leave out the image")
        return values


@functools.cache
def _srgb_curve(bits: int) -> npt.NDArray[np.float32]:
    """Linear value of each number that a sample can hold."""
    return np.asarray(srgb_to_linear(np.arange(2**bits) / (2.0**bits - 1.0)), np.float32)
