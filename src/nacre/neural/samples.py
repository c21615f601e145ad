"""Training samples of a reflectance, and the layout in which the fit reads them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.brdf import Brdf, Floats
from nacre.files import NacreError
from nacre.geometry import join, split, uniform_rusinkiewicz
from nacre.neural.inputs import PAPER, input_count, network_inputs
from nacre.parallel import thread_map

Rows: TypeAlias = tuple[Floats, Floats, Floats]
"""Network inputs (n, k), f_r (n, 3) in 1/sr and cos theta_i (n, 1) of n samples."""

BLOCK = 16
"""Samples that stay together when the order of training is shuffled."""

_CHUNK = 1 << 15
_HOPELESS = 64
"""Chunks without enough valid samples after which drawing gives up."""


@dataclass(frozen=True)
class Samples:
    """Samples for the log-cosine loss, in blocks of :data:`BLOCK`.

    Parameters
    ----------
    blocks
        Flat float32 array on a 64-byte boundary: per block, rows of 16 values each of every
        network input, of log(1 + f cos theta_i) for red, green and blue, and of cos theta_i.
    inputs
        Number of network inputs.
    gain
        Factor k of the loss |log(1 + k f cos) - log(1 + k f' cos)|, at least 1. Targets and cosines
        are stored with it.
    """

    blocks: npt.NDArray[np.float32]
    inputs: int
    gain: float = 1.0

    @property
    def rows(self) -> int:
        """Rows of a block."""
        return self.inputs + 4

    @property
    def block_count(self) -> int:
        """Number of blocks."""
        return len(self.blocks) // (self.rows * BLOCK)

    @classmethod
    def pack(
        cls, inputs: npt.ArrayLike, rgb: npt.ArrayLike, cosine: npt.ArrayLike, gain: float = 1.0
    ) -> Samples:
        """Samples from network inputs (n, k), reflectances (n, 3) in 1/sr and cosines (n,).

        With a gain k the loss is that of k f cos theta_i: cosines are stored times k. The last block is filled up by repeating samples from the start.
        """
        x, f, cos = (np.asarray(a, np.float32) for a in (inputs, rgb, cosine))
        cos = np.float32(gain) * cos
        targets = np.log1p(np.maximum(f, 0.0) * cos[:, None])
        rows = np.concatenate([x, targets, cos[:, None]], axis=1)
        padded = np.take(rows, np.arange(-(-len(rows) // BLOCK) * BLOCK) % len(rows), axis=0)
        blocks = aligned(padded.size)
        shaped = blocks.reshape(-1, rows.shape[1], BLOCK)
        shaped[:] = padded.reshape(-1, BLOCK, rows.shape[1]).transpose(0, 2, 1)
        return cls(blocks, x.shape[1], gain)

    def split(self, share: float) -> tuple[Samples, Samples]:
        """The first blocks, and the last `share` of them (at least one)."""
        held = max(1, round(share * self.block_count))
        cut = len(self.blocks) - held * self.rows * BLOCK
        # Blocks are a multiple of 64 bytes, so both parts stay aligned.
        parts = self.blocks[:cut], self.blocks[cut:]
        return Samples(parts[0], self.inputs, self.gain), Samples(parts[1], self.inputs, self.gain)


def aligned(count: int) -> npt.NDArray[np.float32]:
    """Zeros in a flat float32 array that starts on a 64-byte boundary."""
    raw = np.zeros(count + 16, np.float32)
    start = (-raw.ctypes.data // 4) % 16
    return raw[start : start + count]


def draw(
    brdf: Brdf,
    count: int,
    seed: int,
    progress: Callable[[int, int], None] | None = None,
    inputs: str = PAPER,
    gain: float = 1.0,
) -> Samples:
    """Samples as :func:`draw_rows` draws them, ready to train on."""
    values, rgb, cosine = draw_rows(brdf, count, seed, progress, inputs=inputs)
    return Samples.pack(values, rgb, cosine[:, 0], gain)


def draw_rows(
    brdf: Brdf,
    count: int,
    seed: int,
    progress: Callable[[int, int], None] | None = None,
    everywhere: bool = False,
    inputs: str = PAPER,
) -> Rows:
    """Samples uniform in the Rusinkiewicz angles (NBRDF paper, section 3.1).

    theta_h and theta_d lie in [0, pi/2), phi_d in [0, 2 pi); phi_h in [0, 2 pi) for an anisotropic
    reflectance, else 0. Pairs with a direction below the horizon, and samples that are not valid
    or not finite, are dropped and replaced, so that `count` remain.

    Parameters
    ----------
    brdf
        Reflectance to sample.
    count
        Number of samples.
    seed
        The same seed gives the same samples.
    progress
        Called with the number of samples drawn and `count`.
    everywhere
        Keep samples that are not valid.

    Raises
    ------
    NacreError
        If hardly any sample is valid.
    """
    widths = (input_count(inputs, brdf.isotropic), 3, 1)
    values, rgb, cosine = (np.empty((count, n), np.float32) for n in widths)
    filled = chunk = 0
    while filled < count:
        if chunk > _HOPELESS and filled < chunk * _CHUNK // 1000:
            raise NacreError(f"{brdf.name or 'reflectance'}: hardly any sample is valid")
        wave = range(chunk, chunk + max(1, (count - filled) // _CHUNK))
        for part in thread_map(lambda k: _draw_chunk(brdf, (seed, k), everywhere, inputs), wave):
            kept = min(len(part[0]), count - filled)
            for whole, piece in zip((values, rgb, cosine), part, strict=True):
                whole[filled : filled + kept] = piece[:kept]
            filled += kept
            if progress:
                progress(filled, count)
        chunk = wave.stop
    return values, rgb, cosine


def _draw_chunk(brdf: Brdf, seed: tuple[int, int], everywhere: bool, inputs: str) -> Rows:
    random = np.random.default_rng(seed)
    u = random.random((4, _CHUNK), dtype=np.float32)
    if brdf.isotropic:
        u[1] = 0.0
    wi, wo = uniform_rusinkiewicz(u)
    visible = (wi[2] > 0) & (wo[2] > 0)
    wi, wo = (join(w)[visible] for w in (wi, wo))
    if not everywhere:
        known = brdf.valid(wi, wo)
        wi, wo = wi[known], wo[known]
    rgb = brdf.eval(wi, wo)
    finite = np.isfinite(rgb).all(axis=1)
    wi, wo, rgb = wi[finite], wo[finite], rgb[finite]
    values = network_inputs(split(wi), split(wo), brdf.isotropic, inputs)
    return np.stack(np.broadcast_arrays(*values), -1), rgb, wi[:, 2:]
