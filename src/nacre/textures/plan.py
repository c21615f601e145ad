"""Which directions to photograph: the most informative about texels like those of the training."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.geometry import split, to_spherical
from nacre.io.files import PathLike
from nacre.io.text_file import write_rows
from nacre.measured.textures.directions import from_degrees
from nacre.measured.textures.domes import BONN
from nacre.numerics.sobol import sobol
from nacre.runtime.progress import Progress, silent
from nacre.textures.codecs.codec import LinearBlock, TexelCodec

MAX_POLAR_ANGLE = 75.0
"""Largest polar angle in degrees unless another is asked for: that of the training."""
CANDIDATES = 4096
"""Pairs of directions, or a few times as many as are asked for, that plans are chosen from."""


def candidate_pairs(
    count: int,
    *,
    lights: float = MAX_POLAR_ANGLE,
    views: float = MAX_POLAR_ANGLE,
    flash: bool = False,
    seed: int = 0,
) -> tuple[Floats, Floats]:
    """Pairs of directions that cover evenly a cap of lights and one of views (Sobol 1967).

    `lights` and `views` are their largest polar angles in degrees. With `flash` the light is where
    the camera is, as on a phone; both are then within both angles. The seed scrambles. Gives `wi`
    and `wo`, unit directions, shape (count, 3).
    """
    points = sobol(4, (count - 1).bit_length(), np.random.default_rng(seed))[:count]
    if flash:
        views = min(lights, views)
    wo = _on_cap(points[:, :2], views)
    wi = wo if flash else _on_cap(points[:, 2:], lights)
    return wi, wo


def _on_cap(points: npt.NDArray[np.float64], max_polar_angle: float) -> Floats:
    cosine = 1.0 - points[:, 0] * (1.0 - np.cos(np.radians(max_polar_angle)))
    return from_degrees(np.degrees(np.arccos(cosine)), 360.0 * points[:, 1]).astype(np.float32)


def informative(
    codec: TexelCodec, wi: Floats, wo: Floats, count: int, progress: Progress = silent
) -> npt.NDArray[np.intp]:
    """The numbers of the `count` pairs of directions that leave the least unknown, best first.

    One after the other, each is the pair that lowers most the variance that coefficients still
    have, given all before, as the reflectance at Bonn's directions shows it: Bayesian A-optimal
    design, greedily (Chaloner and Verdinelli 1995). The prior is the codec's, with independent
    coefficients. So the first n of a plan are the plan for n.

    The pairs to choose from, `wi` and `wo`, have shape (n, 3), n at least `count`. Progress is
    called with the pairs chosen. A NacreError says that the codec has no linear model, see
    :meth:`TexelCodec.linear_blocks`.
    """
    blocks = zip(codec.linear_blocks(wi, wo), codec.linear_blocks(*BONN.pairs()), strict=True)
    parts = [_Unknown(here, target.functions) for here, target in blocks]
    chosen = np.empty(count, np.intp)
    open_ = np.ones(len(wi), bool)
    for index in range(count):
        gain = np.where(open_, sum(part.gain() for part in parts), -1.0)
        best = int(gain.argmax())
        chosen[index], open_[best] = best, False
        for part in parts:
            part.observe(best)
        progress("choosing", index + 1, count, "")
    return chosen


class _Unknown:
    """Covariance of some coefficients, and how much each of many measurements would reduce it."""

    def __init__(self, block: LinearBlock, target: Floats) -> None:
        functions = block.functions
        self._functions, self._block = functions.astype(np.float32), block
        values, vectors = np.linalg.eigh(target.astype(np.float64).T @ target)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        covariance = np.diag(block.variances)
        # Of each measurement with the coefficients, and with the reflectance at the target.
        self._cross = (functions @ covariance).astype(np.float32)
        self._seen = (functions @ covariance @ root).astype(np.float32)

    def gain(self) -> Floats:
        """The variance of the target that each measurement would take off."""
        variances = np.einsum("nk,nk->n", self._cross, self._functions)
        explained = np.einsum("nk,nk->n", self._seen, self._seen)
        left = self._block.noise + np.maximum(variances, 0.0)
        return np.asarray(self._block.channels * explained / left)

    def observe(self, index: int) -> None:
        """Know the outcome of a measurement."""
        known = self._functions @ self._cross[index]
        fraction = known / np.float32(self._block.noise + max(known[index], 0.0))
        cross, seen = self._cross[index].copy(), self._seen[index].copy()
        self._cross -= fraction[:, None] * cross
        self._seen -= fraction[:, None] * seen


def write_plan(wi: Floats, wo: Floats, path: PathLike) -> None:
    """Write a list of directions in degrees, with a name for the photograph of each.

    :func:`nacre.measured.textures.direction_list.named_directions` and
    :func:`nacre.measured.textures.load_photographs` read it. A FormatError says that the file
    cannot be written.
    """
    angles = np.degrees(np.stack([*to_spherical(split(wi)), *to_spherical(split(wo))], axis=1))
    angles[:, 1::2] %= 360.0
    digits = max(3, len(str(len(wi))))
    rows = (
        [f"{index:0{digits}d}.png", *(f"{angle:.2f}" for angle in row)]
        for index, row in enumerate(angles, 1)
    )
    columns = ["file", "theta_l", "phi_l", "theta_v", "phi_v"]
    write_rows([columns, *rows], path, "directions of light and view in degrees")
