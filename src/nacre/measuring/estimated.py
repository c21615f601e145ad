"""The estimate of a material from readings: what it is, how well it is known, what is left open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from nacre.errors import NacreError
from nacre.instruments.readings import COMMON, Reading, combined, known_quantities
from nacre.latent import find_basis, pretrained_basis
from nacre.latent.basis import CodedBrdf
from nacre.latent.estimates import Estimate, plausible_codes
from nacre.latent.hypernetwork import neural_basis
from nacre.latent.intervals import reflectance_interval
from nacre.latent.neural_basis import NeuralBasis
from nacre.latent.posterior import UNEXPLAINED, Posterior
from nacre.measuring.from_readings import Expected, posterior_of_readings
from nacre.measuring.predictions import Prediction, Proposal, predict, propose_readings
from nacre.neural import NeuralBrdf, fit
from nacre.runtime.progress import Progress, silent
from nacre.sampling.lit_views import lit_views

DOUBTFUL = 4.0
"""Standard deviations by which a reading may miss what is expected before it is doubted."""

_SHARP, _STEEP = np.cos(np.radians([10.0, 70.0]))


@dataclass(frozen=True, eq=False)
class FromReadings:
    """The result of an estimate from readings.

    Parameters
    ----------
    estimate
        The material, and equally plausible ones.
    posterior
        Of its code.
    readings
        What it was estimated from, each quantity once.
    missed
        What the material misses of each reading, in standard deviations, shape (readings,).
    unexplained
        Median absolute difference between logarithms of readings and of what is expected.
    """

    estimate: Estimate
    posterior: Posterior
    readings: tuple[Reading, ...]
    missed: tuple[float, ...]
    unexplained: float

    @property
    def basis(self) -> NeuralBasis:
        return neural_basis(self.estimate.material.basis)

    @property
    def doubtful(self) -> list[Reading]:
        """Readings that the material does not explain."""
        pairs = zip(self.readings, self.missed, strict=True)
        return [reading for reading, missed in pairs if missed > DOUBTFUL]

    def network(self, *, progress: Progress = silent) -> NeuralBrdf:
        """A network for the material.

        Its metadata hold the plausible materials, but only if their basis is the included one.
        """
        network = fit(self.estimate.material, progress=progress)
        known = self.basis.fingerprint() == pretrained_basis().fingerprint()
        return self.estimate.kept_by(network) if known else network

    def predictions(self, progress: Progress = silent) -> list[Prediction]:
        """What common instruments would read of the material; what they have read comes first."""
        read = [reading.quantity for reading in self.readings]
        names = {quantity.name for quantity in read}
        plain = [quantity for quantity in known_quantities(COMMON) if quantity.name not in names]
        found = []
        for index, quantity in enumerate((*read, *plain)):
            progress("predicting", index, len(read) + len(plain), quantity.name)
            code = self.posterior.code
            found.append(predict(self.basis, code, self.estimate.codes, quantity))
        return found

    def known_within(self) -> Mapping[str, float]:
        """Factors within which f_r is known, by where: medians of the 90 % intervals."""
        lit = lit_views(0, directions=32)
        wi, wo = lit.wi.reshape(-1, 3), np.broadcast_to(lit.wo, lit.wi.shape).reshape(-1, 3)
        half = wi + wo
        along = half[:, 2] / np.linalg.norm(half, axis=1)
        steep = np.minimum(wi[:, 2], wo[:, 2]) < _STEEP
        sharp = along > _SHARP
        materials = [self.basis.decode(code) for code in self.estimate.codes]
        low, high = reflectance_interval(materials, wi, wo)
        factor = np.sqrt(high / np.maximum(low, 1e-12)).max(axis=1)
        places = {
            "near the mirror direction": sharp & ~steep,
            "beyond 70 degrees": steep,
            "elsewhere": ~sharp & ~steep,
        }
        return {where: float(np.median(factor[part])) for where, part in places.items()}

    def propose(
        self,
        count: int = 1,
        *,
        instruments: Sequence[str] = COMMON,
        until: float = 0.0,
        seed: int = 0,
        progress: Progress = silent,
    ) -> tuple[float, list[Proposal]]:
        """The next readings; see :func:`nacre.measuring.predictions.propose_readings`."""
        names = {reading.quantity.name for reading in self.readings}
        left = [each for each in known_quantities(instruments) if each.name not in names]
        return propose_readings(
            self.basis, self.posterior, left, count, until=until, seed=seed, progress=progress
        )


def estimate_from_readings(
    readings: Sequence[Reading],
    basis_name: str = "neural",
    *,
    name: str = "",
    progress: Progress = silent,
) -> FromReadings:
    """A material from readings of instruments, through the prior over codes.

    Repeated readings count as one, their mean.

    Raises
    ------
    NacreError
        If there is no reading, or the basis is not a neural one.
    """
    if not readings:
        raise NacreError("an estimate takes one reading or more")
    basis = neural_basis(find_basis(basis_name))
    each = combined(readings)
    progress("estimating", 0, 1, "")
    found = posterior_of_readings(basis, each)
    progress("estimating", 1, 1, "")
    off, missed = [], []
    for reading in each:
        expected = Expected.known(basis, reading.quantity)
        apart = np.abs(expected.logarithm(reading.seen) - expected.of(found.code))
        off.append(float(np.median(apart)))
        deviation = np.hypot(expected.noise(reading), UNEXPLAINED / expected.precision)
        missed.append(float((apart / deviation).max()))
    material: CodedBrdf = basis.decode(found.code, name)
    count = len(each)
    estimate = Estimate(material, plausible_codes(found), count, observed="readings")
    return FromReadings(estimate, found, tuple(each), tuple(missed), float(np.median(off)))
