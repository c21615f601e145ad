"""Axes of codes along which an error of 1 looks the same everywhere, the most telling first."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.measured.textures.domes import BONN
from nacre.runtime.parallel import one_blas_thread
from nacre.textures.latent_map import LatentMap

Double = npt.NDArray[np.float64]

_SAMPLED = 1 << 13  # texels, about, that the axes are found from
_RIDGE = 1e-6  # times the mean: no direction of codes counts less


@dataclass(frozen=True, eq=False)
class CodeSpace:
    """Codes as numbers along axes: (code - center) @ onto.

    The decoder feels a change by 1 along any axis as the same root mean squared change of square
    roots of reflectance. Numbers along the axes are uncorrelated, the largest first.
    """

    center: Double  # shape (code_dim,)
    onto: Double  # shape (code_dim, code_dim)
    felt: Double  # how much a change of each value of a code by 1 is felt, shape (code_dim,)

    @classmethod
    def of(cls, latent: LatentMap) -> CodeSpace:
        """The space of the codes of a map.

        The metric is that of how texels look, as far as that is linear in the codes: exactly, for a
        linear decoder. Raises what :meth:`nacre.textures.codecs.TexelCodec.embedding` does.
        """
        codec, (height, width, _) = latent.codec, latent.shape
        chosen = slice(None, None, max(1, height * width // _SAMPLED))
        sample = latent.codes_of(chosen).astype(np.float32)
        with one_blas_thread():
            return cls._of(sample, codec.embedding(*looked_at(latent))(sample).astype(np.float64))

    @classmethod
    def _of(cls, sample: Floats, looks: Double) -> CodeSpace:
        size = sample.shape[1]
        mean = sample.mean(axis=0, dtype=np.float64)
        about = sample - mean
        slopes = np.linalg.lstsq(about, looks - looks.mean(axis=0), rcond=None)[0]
        metric = slopes @ slopes.T
        metric += max(_RIDGE * np.trace(metric) / size, 1e-12) * np.eye(size)
        root = np.linalg.cholesky(metric)  # distances of codes @ root are those of looks
        _, turn = np.linalg.eigh(root.T @ (about.T @ about) @ root)
        return cls(mean, root @ turn[:, ::-1], np.sqrt(np.diag(metric)))


def looked_at(latent: LatentMap) -> tuple[Floats, Floats]:
    """Pairs of directions at which texels are compared: a whole dome, or those of the codec."""
    return BONN.pairs() if latent.codec.any_directions else (latent.wi, latent.wo)
