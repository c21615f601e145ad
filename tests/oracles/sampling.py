"""Is what a target draws what its material says? Tests of drawn directions, densities and weights.

The reference of a material and a view is computed in float64 by nacre: the probability of each of
a few hundred cells of the hemisphere, which are small where the density is high, and the albedo.
Drawn directions are counted in the cells (chi-square), their densities compared with the
material's, and the mean of f cos / pdf with the albedo.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.special import chdtrc

from nacre.array import Floats, Scalars, VectorList, Weights
from nacre.brdf import Brdf
from nacre.geometry import join
from tests.oracles.quadrature import integrate
from tests.oracles.runner import PARITY, Runner, worst_error

_TAIL = [1 / 4096, 1 / 1024, 1 / 256, 1 / 64]
_STEPS = [k / 16 for k in range(1, 16)]
_QUANTILES = [0.0, *_TAIL, *_STEPS, *(1.0 - x for x in reversed(_TAIL)), 1.0]
"""Of the directions of a reference, where cells end: tails have cells of their own."""

_LENGTH_ERROR = 1e-5  # of a direction
_STANDARD_ERRORS = 5.0  # that a mean may be off
_MIN_DIFFERENCE = 1e-9  # difference of means that counts: of a material that is black
_MIN_EXPECTED = 5.0  # samples of a cell, for chi-square to hold


def view(degrees: float, azimuth: float = 0.6) -> npt.NDArray[np.float32]:
    """Direction to the viewer, shape (3,), at an angle from the normal in degrees."""
    theta = math.radians(degrees)
    wo = math.sin(theta) * math.cos(azimuth), math.sin(theta) * math.sin(azimuth), math.cos(theta)
    return np.array(wo, np.float32)


@dataclass(frozen=True)
class Reference:
    """What samples of a material seen from `wo`, shape (3,), are held against.

    Attributes
    ----------
    depth, azimuth
        Edges of cells of the hemisphere: of rings, in 1 - z, shape (n + 1,), and within each ring,
        in radians, shape (n, n + 1).
    probability
        Of a sample in each cell, shape (n, n); what they lack to 1 are samples of no direction.
    albedo
        Integral of f cos, shape (3,).
    error
        Bound of the error of `albedo`, shape (3,).
    """

    material: Brdf
    wo: npt.NDArray[np.float32]
    depth: Floats
    azimuth: Floats
    probability: Floats
    albedo: Floats
    error: Floats

    @classmethod
    def of(cls, material: Brdf, wo: npt.NDArray[np.float32]) -> Reference:
        """Integrate a material's density and its f cos for one view."""
        toward = wo.astype(np.float64)

        def integrands(depth: Scalars, azimuth: Scalars) -> Floats:
            sine, z = np.sqrt(depth * (2.0 - depth)), 1.0 - depth
            wi = join((sine * np.cos(azimuth), sine * np.sin(azimuth), z))
            return np.c_[material.pdf(wi, toward), z[:, None] * material.eval(wi, toward)]

        u = np.random.default_rng(11).random((1 << 17, 3))
        wi, pdf = material.sample(np.broadcast_to(toward, u.shape), u)
        depth, azimuth = _edges(wi[pdf > 0.0])
        boxes = np.stack(
            np.broadcast_arrays(depth[:-1, None], depth[1:, None], azimuth[:, :-1], azimuth[:, 1:]),
            axis=-1,
        )
        values, errors = integrate(integrands, boxes.reshape(-1, 4))
        probability = values[:, 0].reshape(boxes.shape[:2])
        albedo, error = (x[:, 1:].sum(axis=0) for x in (values, errors))
        return cls(material, wo, depth, azimuth, probability, albedo, error)


@dataclass(frozen=True)
class Findings:
    """What was found of samples of one view.

    Attributes
    ----------
    p_value
        Probability of counts as far from those expected, if the target draws what it should.
    density_error
        That of :func:`density_error`.
    weight_error
        Largest difference of a channel's mean of f cos / pdf from the albedo, in its bound: five
        standard errors of the mean, the error of the albedo, and what parity lets `eval` be off.
    """

    p_value: float
    density_error: float
    weight_error: float

    @property
    def passed(self) -> bool:
        """Whether all is as it should be; so many tests are made that chance needs 1e-5."""
        return self.p_value > 1e-5 and self.density_error <= 1.0 and self.weight_error <= 1.0


def inspect(
    runner: Runner,
    files: Mapping[str, bytes],
    name: str,
    references: Sequence[Reference],
    count: int = 1 << 18,
) -> list[Findings]:
    """Draw `count` samples for each view of a material, and judge them."""
    wo = np.repeat([reference.wo for reference in references], count, axis=0)
    u = np.random.default_rng(12).random((len(wo), 3), np.float32)
    drawn = runner.run(files, name, "sample", wo, u)
    rgb = runner.run(files, name, "eval", np.ascontiguousarray(drawn[:, :3]), wo)
    parts = len(references), count, -1
    return [
        _judged(*each)
        for each in zip(references, drawn.reshape(parts), rgb.reshape(parts), strict=True)
    ]


def density_error(material: Brdf, samples: Weights, wo: Weights) -> float:
    """Largest error of drawn directions and of the densities that were returned with them.

    Parameters
    ----------
    material
        Of which the density of a direction is computed in double precision.
    samples
        Directions to the light and their densities, shape (n, 4).
    wo
        Directions to the viewer, shape (n, 3).

    Returns
    -------
    float
        In multiples of what :data:`tests.oracles.runner.PARITY` allows a density, and of 1e-5 for
        the length of a direction; infinite where a number is none.
    """
    if not np.isfinite(samples).all():
        return math.inf
    # Of what has no direction above the horizon, nothing is said but that its density is 0.
    there = (samples[:, 3] != 0.0) | (samples[:, 2] > 0.0)
    wi, pdf = samples[there, :3].astype(np.float64), samples[there, 3]
    length = float(np.abs(np.linalg.norm(wi, axis=1) - 1.0).max(initial=0.0)) / _LENGTH_ERROR
    if length > 1.0:
        return length
    return worst_error(pdf, material.pdf(wi, wo[there].astype(np.float64)))


def _judged(reference: Reference, samples: Weights, rgb: Weights) -> Findings:
    """Findings of samples, shape (n, 4), and of f_r at them, shape (n, 3)."""
    error = density_error(reference.material, samples, np.broadcast_to(reference.wo, rgb.shape))
    if not (np.isfinite(error) and np.isfinite(rgb).all()):
        return Findings(0.0, error, math.inf)
    wi, pdf = samples[:, :3].astype(np.float64), samples[:, 3].astype(np.float64)
    inverse = np.divide(1.0, pdf, where=pdf > 0.0, out=np.zeros_like(pdf))
    weights = (wi[:, 2] * inverse)[:, None] * rgb
    bound = _STANDARD_ERRORS * weights.std(axis=0) / math.sqrt(len(weights)) + reference.error
    bound += PARITY[0] * reference.albedo + _MIN_DIFFERENCE
    return Findings(
        p_value=_p_value(reference, wi[pdf > 0.0], len(wi)),
        density_error=error,
        weight_error=float((np.abs(weights.mean(axis=0) - reference.albedo) / bound).max()),
    )


def _p_value(reference: Reference, wi: VectorList, total: int) -> float:
    """That of Pearson's chi-square test; of `total` samples, `wi` are those above the horizon."""
    depth, azimuth = _coordinates(wi)
    rings = _rings(reference.depth, depth)
    counts = np.stack(
        [
            np.histogram(azimuth[ring], edges)[0]
            for ring, edges in zip(rings, reference.azimuth, strict=True)
        ]
    )
    counts = np.append(counts, total - len(wi))
    expected = np.append(reference.probability, 1.0 - reference.probability.sum()) * total
    few = expected < _MIN_EXPECTED
    counts, expected = (np.append(x[~few], x[few].sum()) for x in (counts, expected))
    if expected[-1] < _MIN_EXPECTED:  # too few even together
        counts, expected = (np.append(x[:-2], x[-2:].sum()) for x in (counts, expected))
    statistic = ((counts - expected) ** 2 / expected).sum()
    return float(chdtrc(len(counts) - 1, statistic))


def _coordinates(wi: VectorList) -> tuple[Scalars, Scalars]:
    """1 - z and azimuth, whose products are solid angles; 1 - z as float32 resolves it at z = 1."""
    x, y, z = wi.T
    return (x * x + y * y) / (1.0 + z), np.arctan2(y, x)


def _edges(wi: VectorList) -> tuple[Floats, Floats]:
    """Edges of the cells of a :class:`Reference`, from directions that its material draws."""
    depths, azimuths = _coordinates(wi)
    depth = np.concatenate([[0.0], np.quantile(depths, _QUANTILES), [1.0]])
    inner = [
        np.quantile(azimuths[ring], _QUANTILES)
        if ring.any()
        else np.linspace(-3.0, 3.0, len(_QUANTILES))
        for ring in _rings(depth, depths)
    ]
    ends = np.full((len(inner), 1), math.pi)
    return depth, np.concatenate([-ends, np.stack(inner), ends], axis=1)


def _rings(edges: Floats, depths: Scalars) -> Iterator[npt.NDArray[np.bool_]]:
    """Which of some depths lie in each ring."""
    ring = np.clip(np.searchsorted(edges, depths, side="right") - 1, 0, len(edges) - 2)
    return (ring == i for i in range(len(edges) - 1))
