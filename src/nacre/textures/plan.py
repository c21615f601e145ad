"""Which directions to photograph: those that tell most about texels of the training's kind."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.stats import qmc

from nacre.array import Floats
from nacre.geometry import split, to_spherical
from nacre.io.files import PathLike
from nacre.io.text_file import write_rows
from nacre.measured.textures.directions import from_degrees
from nacre.measured.textures.domes import BONN
from nacre.runtime.progress import Progress, silent
from nacre.textures.codecs.basis.codec import BasisCodec

STEEPEST = 75.0
"""Largest polar angle in degrees unless another is asked for: that of the training."""
CANDIDATES = 4096
"""Pairs of directions, or a few times as many as are asked for, that plans are chosen from."""


def candidate_pairs(
    count: int,
    *,
    lights: float = STEEPEST,
    views: float = STEEPEST,
    flash: bool = False,
    seed: int = 0,
) -> tuple[Floats, Floats]:
    """Pairs of directions spread evenly over a cap of lights and one of views (Sobol 1967).

    Parameters
    ----------
    count
        Of pairs.
    lights, views
        Largest polar angles in degrees.
    flash
        Whether the light is where the camera is, as a phone's; both are then within both angles.
    seed
        Of the scrambling.

    Returns
    -------
    wi, wo
        Unit directions, shape (count, 3).
    """
    points = qmc.Sobol(4, rng=np.random.default_rng(seed)).random_base2((count - 1).bit_length())
    points = points[:count]
    if flash:
        views = min(lights, views)
    wo = _on_cap(points[:, :2], views)
    wi = wo if flash else _on_cap(points[:, 2:], lights)
    return wi, wo


def _on_cap(points: npt.NDArray[np.float64], steepest: float) -> Floats:
    cosine = 1.0 - points[:, 0] * (1.0 - np.cos(np.radians(steepest)))
    return from_degrees(np.degrees(np.arccos(cosine)), 360.0 * points[:, 1]).astype(np.float32)


def informative(
    codec: BasisCodec, wi: Floats, wo: Floats, count: int, progress: Progress = silent
) -> npt.NDArray[np.intp]:
    """Pairs of directions that leave least unknown, the most telling first.

    One after the other, each is the pair that lowers most the variance that coefficients still
    have, given all before, as the reflectance at Bonn's directions shows it: Bayesian A-optimal
    design, greedily (Chaloner and Verdinelli 1995). The prior is that of the codec, with
    coefficients independent. So the first n of a plan are the plan for n.

    Parameters
    ----------
    codec
        For whose coefficients.
    wi, wo
        Pairs to choose from, shape (n, 3).
    count
        How many to choose, at most n.
    progress
        Called with pairs chosen.

    Returns
    -------
    array of shape (count,)
        Their numbers.
    """
    here, target = codec.functions(wi, wo), codec.functions(*BONN.pairs())
    greys = codec.functions.greys
    variances = codec.prior.deviations.astype(np.float64) ** 2
    # Both values of a pair of colors have the same functions, hence the same variances.
    parts = [
        _Unknown(here.grey, target.grey, variances[:greys], codec.prior.noise, 1.0),
        _Unknown(
            here.chroma,
            target.chroma,
            variances[greys : greys + codec.functions.chromas],
            codec.prior.noise,
            2.0,
        ),
    ]
    chosen = np.empty(count, np.intp)
    open_ = np.ones(len(wi), bool)
    for index in range(count):
        gain = np.where(open_, parts[0].gain() + parts[1].gain(), -1.0)
        best = int(gain.argmax())
        chosen[index], open_[best] = best, False
        for part in parts:
            part.observe(best)
        progress("choosing", index + 1, count, "")
    return chosen


class _Unknown:
    """Covariance of some coefficients, and what each of many measurements would take off it."""

    def __init__(
        self,
        functions: Floats,
        target: Floats,
        variances: npt.NDArray[np.float64],
        noise: float,
        times: float,
    ) -> None:
        self._functions, self._noise, self._times = functions.astype(np.float32), noise, times
        values, vectors = np.linalg.eigh(target.astype(np.float64).T @ target)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        covariance = np.diag(variances)
        # Of each measurement with the coefficients, and with the reflectance at the target.
        self._cross = (functions @ covariance).astype(np.float32)
        self._seen = (functions @ covariance @ root).astype(np.float32)

    def gain(self) -> Floats:
        """What variance of the target each measurement would take off."""
        spread = np.einsum("nk,nk->n", self._cross, self._functions)
        shown = np.einsum("nk,nk->n", self._seen, self._seen)
        gains: Floats = self._times * shown / (self._noise + np.maximum(spread, 0.0))
        return gains

    def observe(self, index: int) -> None:
        """Know the outcome of a measurement."""
        known = self._functions @ self._cross[index]
        share = known / np.float32(self._noise + max(known[index], 0.0))
        cross, seen = self._cross[index].copy(), self._seen[index].copy()
        self._cross -= share[:, None] * cross
        self._seen -= share[:, None] * seen


def write_plan(wi: Floats, wo: Floats, path: PathLike) -> None:
    """Write a list of directions in degrees, with a name for the photograph of each.

    It is what :func:`nacre.measured.textures.direction_list.named_directions` and
    :func:`nacre.measured.textures.load_photographs` read.

    Raises
    ------
    FormatError
        If the file cannot be written.
    """
    angles = np.degrees(np.stack([*to_spherical(split(wi)), *to_spherical(split(wo))], axis=1))
    angles[:, 1::2] %= 360.0
    digits = max(3, len(str(len(wi))))
    rows = [["file", "theta_l", "phi_l", "theta_v", "phi_v"]]
    for index, row in enumerate(angles):
        rows.append([f"{index + 1:0{digits}d}.png", *(f"{angle:.2f}" for angle in row)])
    write_rows(rows, path)
