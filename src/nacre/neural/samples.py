"""Training samples of a reflectance, and the layout in which the fit reads them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from nacre.array import Components, Floats, Weights, aligned_zeros
from nacre.brdf import Brdf
from nacre.geometry import rotate, split
from nacre.neural.axes import main_axis
from nacre.neural.inputs import PAPER, has_axes, input_count, network_inputs, rotates_half_vector
from nacre.neural.nbrdf import OUTPUTS
from nacre.numerics.direction_samples import DirectionSamples
from nacre.runtime.parallel import thread_map
from nacre.sampling import draw_samples

BLOCK = 16  # samples that stay together when the order of training is shuffled

MIN_SLOPE = 1e-3
"""What e^x counts as at least in the gradient by x where f_r is e^x and too low: one that fell far
must be able to rise again."""

_CHUNK = 1 << 15
_GOLDEN_ANGLE = math.pi * (3.0 - math.sqrt(5.0))
_LARGEST = np.float32(1e30)  # of f cos: products in the loss must not overflow


@dataclass(frozen=True)
class Samples:
    """Samples for the log-cosine loss, in blocks of :data:`BLOCK`."""

    blocks: Weights
    """Flat float32 array on a 64-byte boundary: per block, rows of 16 values each of every network
    input, of f cos theta_i for every output, and of cos theta_i. Any weight may take the place of
    the cosine, as it does for scans."""
    inputs: int  # number of network inputs
    angle: float = 0.0  # azimuth of the axis that they take for x; see network_inputs
    outputs: int = OUTPUTS  # number of network outputs: red, green and blue, or bands

    @property
    def rows(self) -> int:
        """Rows of a block."""
        return self.inputs + self.outputs + 1

    @property
    def block_count(self) -> int:
        return len(self.blocks) // (self.rows * BLOCK)

    @classmethod
    def pack(
        cls,
        inputs: npt.ArrayLike,
        values: npt.ArrayLike,
        weight: npt.ArrayLike,
        angle: float = 0.0,
    ) -> Samples:
        """Samples from network inputs (n, k), reflectances (n, outputs) in 1/sr and weights (n,).

        The last block is filled up by repeating samples from the start.
        """
        x, f, w = (np.asarray(a, np.float32) for a in (inputs, values, weight))
        made = cls.empty(len(x), x.shape[1], angle, f.shape[1])
        filled = np.arange(made.block_count * BLOCK) % len(x)
        made.fill(0, x[filled], f[filled], w[filled])
        return made

    @classmethod
    def empty(cls, count: int, inputs: int, angle: float = 0.0, outputs: int = OUTPUTS) -> Samples:
        """Room for a number of samples."""
        size = -(-count // BLOCK) * (inputs + outputs + 1) * BLOCK
        return cls(aligned_zeros(size), inputs, angle, outputs)

    def fill(self, first: int, inputs: Floats, values: Floats, weight: Floats) -> None:
        """Write whole blocks of samples, as :meth:`pack` takes them, from a block on."""
        count = len(inputs) // BLOCK
        blocks = self.blocks.reshape(-1, self.rows, BLOCK)[first : first + count]
        with np.errstate(over="ignore"):
            targets = np.clip(values * weight[:, None], 0.0, _LARGEST)
        for row, numbers in enumerate((*inputs.T, *targets.T, weight)):
            blocks[:, row] = numbers.reshape(count, BLOCK)

    def split(self, fraction: float) -> tuple[Samples, Samples]:
        """The first blocks, and the last `fraction` of them (at least one)."""
        held = max(1, round(fraction * self.block_count))
        cut = len(self.blocks) - held * self.rows * BLOCK
        # Blocks are a multiple of 64 bytes, so both parts stay aligned.
        return replace(self, blocks=self.blocks[:cut]), replace(self, blocks=self.blocks[cut:])


def draw(
    brdf: Brdf,
    count: int,
    seed: int,
    progress: Callable[[int, int], None] | None = None,
    inputs: str = PAPER,
    gain: float = 1.0,
    distribution: str = "rusinkiewicz",
) -> Samples:
    """Samples at random directions, ready to train on.

    See :func:`nacre.sampling.draw_samples`, which also has the errors, and
    :func:`nacre.neural.inputs.network_inputs`. `gain` is k of the loss |log(1 + k f cos) - log(1 +
    k f' cos)|.
    """
    samples = draw_samples(brdf, count, seed, progress, distribution)
    angle = axis_angle(samples, brdf.isotropic, inputs)
    made = Samples.empty(count, input_count(inputs, brdf.isotropic), angle)

    def fill(start: int) -> None:
        # The last block is filled up by repeating samples from the start.
        end = min(start + _CHUNK, made.block_count * BLOCK)
        part = np.arange(start, end) % count if end > count else slice(start, end)
        chunk = DirectionSamples(samples.wi[part], samples.wo[part], samples.rgb[part])
        values = direction_inputs(chunk, brdf.isotropic, inputs, angle)
        weight = np.asarray(gain * chunk.cosine, np.float32)
        made.fill(start // BLOCK, np.asarray(values, np.float32), chunk.rgb, weight)

    for _ in thread_map(fill, range(0, count, _CHUNK)):
        pass
    return made


def axis_angle(samples: DirectionSamples, isotropic: bool, inputs: str) -> float:
    """The `angle` of the inputs for a material with these samples; 0 where inputs have no axes."""
    return main_axis(samples) if has_axes(inputs, isotropic) else 0.0


def direction_inputs(
    samples: DirectionSamples, isotropic: bool, inputs: str = PAPER, angle: float = 0.0
) -> Floats:
    """Network inputs of samples, shape (n, k)."""
    wi, wo = split(samples.wi), split(samples.wo)
    if isotropic and not rotates_half_vector(inputs, isotropic):
        wi, wo = _rotated_apart(wi, wo)
    values = network_inputs(wi, wo, isotropic, inputs, angle)
    return np.stack(np.broadcast_arrays(*values), axis=-1)


def _rotated_apart(wi: Components, wo: Components) -> tuple[Components, Components]:
    """Pairs rotated about the normal, each by the golden angle from the one before."""
    angle = (np.arange(len(wi[0])) * _GOLDEN_ANGLE).astype(np.float32)
    return rotate(wi, angle), rotate(wo, angle)
