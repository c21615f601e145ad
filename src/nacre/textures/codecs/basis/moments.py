"""Products of texels with the functions of the default codec, in one pass over reflectance."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats, aligned_zeros
from nacre.compile.compilation import Compiled
from nacre.compile.vector_code import LANES
from nacre.textures.codecs.basis.networks import FunctionValues
from nacre.textures.codecs.basis.tile_sizes import BLOCK, HALVES, ROWS, padded, panels

_moments = Compiled("nacre.textures.codecs.basis.moment_loops:moments")


class Moments:
    """What :meth:`FunctionValues.products` gives for luma, less its mean, and chroma of texels.

    Functions are laid out as the compiled loop reads them: blocks of pairs of directions, in them
    panels of functions, padded with zeros.
    """

    def __init__(self, functions: FunctionValues) -> None:
        self._pairs = len(functions.mean)
        self._sizes = functions.luma.shape[1], functions.chroma.shape[1]
        self._luma = panels(functions.luma)
        self._chroma = panels(functions.chroma, LANES)
        self._mean = aligned_zeros(len(self._luma) * BLOCK)
        self._mean[: self._pairs] = functions.mean

    def __call__(self, texels: npt.NDArray[Any]) -> Floats:
        """Moments (b, K) of reflectance (b, n, 3) in half or single precision.

        Reflectance below 0, as noise of a measurement may leave it, counts as 0; moments of a texel
        with values that are not finite are not, either.
        """
        half = HALVES and texels.dtype == np.float16
        rgb: npt.NDArray[Any] = np.ascontiguousarray(texels, np.float16 if half else np.float32)
        rgb = rgb.view(np.int16 if half else np.float32).reshape(len(texels), 3 * self._pairs)
        texel_count = padded(len(rgb), ROWS)
        luma, chroma = (
            aligned_zeros((texel_count // ROWS, rows, blocks.shape[1] * blocks.shape[3]))
            for rows, blocks in ((ROWS, self._luma), (2 * ROWS, self._chroma))
        )
        sums = aligned_zeros(3 * ROWS * BLOCK), luma, chroma
        whole = self._pairs // BLOCK
        self._add(rgb, slice(whole), sums)
        if rest := self._pairs % BLOCK:
            last = np.zeros((len(rgb), 3 * BLOCK), rgb.dtype)
            last[:, : 3 * rest] = rgb[:, -3 * rest :]
            self._add(last, slice(whole, None), sums)
        grey, color = luma.reshape(texel_count, -1), chroma.reshape(texel_count, 2, -1)
        first, second = self._sizes
        parts = grey[:, :first], color[:, 0, :second], color[:, 1, :second]
        return np.concatenate(parts, axis=1)[: len(rgb)]

    def _add(self, rgb: npt.NDArray[Any], blocks: slice, sums: tuple[Floats, ...]) -> None:
        parts, luma, chroma = sums
        mean = self._mean.reshape(-1, BLOCK)[blocks].reshape(-1)
        functions = self._luma[blocks], self._chroma[blocks]
        _moments(rgb.reshape(-1), rgb.shape[1], len(rgb), mean, *functions, parts, luma, chroma)
