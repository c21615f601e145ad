"""The pairs of directions to measure next, given earlier measurements."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.latent.intervals import reflectance_interval
from nacre.latent.neural_basis import NeuralBasis
from nacre.latent.posterior import Posterior
from nacre.measuring.design import Design, displayed
from nacre.measuring.instrument import Instrument
from nacre.numerics.direction_samples import DirectionSamples
from nacre.runtime.progress import Progress, silent

PAYS = 0.01
"""A measurement is worthwhile if it lowers the expected error by at least this fraction."""

_DRAWS = 48  # codes drawn from the posterior
_CONSIDERED = 256  # more samples than this would change little


@dataclass(frozen=True)
class Proposal:
    """Proposed measurements, in order, and their expected results.

    Parameters
    ----------
    wi, wo
        Unit directions to the light and to the viewer, shapes (n, 3), float32. Pairs of one
        exposure are adjacent.
    expected, low, high
        f_r in 1/sr, linear RGB, and its 90 % interval, shapes (n, 3).
    errors
        Expected mean absolute error of displayed values, now and after each of the exposures, shape
        (1 + exposures,).
    """

    wi: npt.NDArray[np.float32]
    wo: npt.NDArray[np.float32]
    expected: npt.NDArray[np.float64]
    low: npt.NDArray[np.float64]
    high: npt.NDArray[np.float64]
    errors: npt.NDArray[np.float64]

    @property
    def pays(self) -> bool:
        """Whether the first measurement is worthwhile; see :data:`PAYS`."""
        return len(self.errors) > 1 and bool(self.errors[1] < (1.0 - PAYS) * self.errors[0])


def propose(
    basis: NeuralBasis,
    posterior: Posterior,
    measured: DirectionSamples,
    instrument: Instrument,
    count: int,
    *,
    until: float = 0.0,
    seed: int = 0,
    progress: Progress = silent,
) -> Proposal:
    """The exposures that add most to earlier measurements.

    They are chosen as for a plan, but for codes that are still possible.

    Parameters
    ----------
    posterior, measured
        The posterior of the code, and the samples behind it.
    instrument
        Limits what can be measured.
    count
        At most this many exposures.
    until
        Expected error at which to stop; see :class:`Proposal`.
    seed
        For drawing codes.
    progress
        Called with the exposures chosen.

    Raises
    ------
    NacreError
        If the instrument reaches no pair of directions.
    """
    exposures = instrument.exposures()
    codes = posterior.draw(_DRAWS, seed)
    if len(measured) > _CONSIDERED:
        measured = measured[np.random.default_rng(seed).permutation(len(measured))[:_CONSIDERED]]
    design = Design(basis, codes, exposures, (measured.wi, measured.wo))
    errors, before = [_expected_error(basis, posterior.code, codes)], design.left()
    for index in range(min(count, len(exposures))):
        if errors[-1] <= until:
            break
        design.choose()
        errors.append(errors[0] * math.sqrt(design.left() / before))
        progress("choosing", index + 1, count, f"expected error {errors[-1]:.4f}")
    wi, wo = (w[design.chosen].reshape(-1, 3) for w in (exposures.wi, exposures.wo))
    plausible = [basis.decode(code) for code in codes]
    low, high = reflectance_interval(plausible, wi, wo) if len(wi) else (wi, wo)
    middle = basis.decode(posterior.code).eval(wi, wo)
    return Proposal(wi, wo, *map(np.asarray, (middle, low, high, errors)))


def _expected_error(
    basis: NeuralBasis, code: npt.NDArray[np.float64], others: npt.ArrayLike
) -> float:
    """Mean absolute difference of displayed values between a code and others, (m, k)."""
    shown = displayed(basis, np.concatenate([np.asarray(code)[None], others]))
    return float(np.abs(shown[1:] - shown[:1]).mean())
