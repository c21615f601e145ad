"""A Gaussian process over pairs of directions, fitted in closed form.

After "Fast and Accurate Gaussian Process Modelling of Real-World Materials" (ACM Transactions on
Graphics 2026, doi 10.1145/3806194). We know its abstract only, from which we take the regression,
the generalized distance kernel |x - z|^p, and that size follows the number of observations. The
rest is ours: x are the inputs of nacre's networks, and points are chosen one after the other from a
fixed design, where the abstract factorizes a grid. The logarithm of f_r + 0.001 is the posterior
mean of a process with this kernel and a linear mean.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from nacre.array import Array, Components, Doubles, Floats, Weights, namespace
from nacre.brdf import Brdf
from nacre.color import GAMMA
from nacre.errors import NacreError
from nacre.geometry import from_rusinkiewicz_angles, from_spherical, join, split
from nacre.neural.inputs import ENHANCED, network_inputs
from nacre.neural.samples import axis_angle
from nacre.numerics.direction_samples import DirectionSamples
from nacre.sampling import LobeSampledBrdf, draw_samples

_SCALES = 2.0, 1.5, 1.0, 1.0, 0.3, 0.3
"""What the inputs of isotropic materials are multiplied by: one over their length scales."""
_ANISOTROPIC_SCALES = 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.3, 0.3

_DARKEST = 1e-3  # added to f_r in 1/sr before its logarithm
_NOISE = 1e-6  # relative variance of the noise; less lets the process overshoot between samples
_NEW = 1e-10  # part of a point's kernel that others must not explain for it to be chosen
_PER_POINT = 12  # samples for each point of the design
_GRAZING = 0.01, 0.05  # near cosines below these, half of the design is dense


class GaussianProcessBrdf(LobeSampledBrdf):
    """A Gaussian process at some points of a design.

    Parameters
    ----------
    chosen
        Indices of the points, increasing, below `size`.
    size
        Number of points of the design, which all materials share; a bit each says which are chosen.
    weights
        Half-precision numbers for the mean, then for the points, shape (1 + inputs + points, 3).
    isotropic
        Whether f_r is unchanged when both directions turn about the normal.
    angle
        Azimuth of the axis of an anisotropic material, in radians.
    """

    isotropy_known = True

    def __init__(
        self,
        chosen: npt.NDArray[np.int64],
        size: int,
        weights: npt.NDArray[np.float16],
        *,
        isotropic: bool = True,
        angle: float = 0.0,
        name: str = "",
    ) -> None:
        super().__init__(name=name)
        self.isotropic, self._angle, self._size = isotropic, angle, size
        self._scales = _scales(isotropic)
        design = _points(size, isotropic, angle)
        points, mean = design[chosen], 1 + len(self._scales)
        self._apart = np.ascontiguousarray(-2.0 * points.T, np.float32)
        self._squares = (points**2).sum(axis=1).astype(np.float32)
        whole = weights.astype(np.float64)
        whole[:mean] -= trends(design, points) @ whole[mean:]
        self._biases: Weights = whole[0].astype(np.float32)
        self._weights: Weights = np.ascontiguousarray(whole[1:], np.float32)

    @property
    def nbytes(self) -> int:
        """Bytes of the weights, of the bits that choose points, and of the axis."""
        numbers = self._biases.size + self._weights.size
        return 2 * numbers + self._size // 8 + (0 if self.isotropic else 4)

    def eval_components(self, wi: Components, wo: Components) -> Components:
        xp = namespace(*wi, *wo)
        inputs = network_inputs(wi, wo, self.isotropic, ENHANCED, self._angle)
        x = [scale * value for scale, value in zip(self._scales, inputs, strict=True)]
        length = sum(value * value for value in x)
        squares = xp.dense(x, self._apart, self._squares)
        kernel = [_kernel(xp.maximum(square + length, 0.0)) for square in squares]
        red, green, blue = xp.dense([*x, *kernel], self._weights, self._biases)
        return xp.exp(red) - _DARKEST, xp.exp(green) - _DARKEST, xp.exp(blue) - _DARKEST


def fit(brdf: Brdf, nbytes: int, seed: int = 0) -> GaussianProcessBrdf:
    """The process of at most `nbytes` bytes for a reflectance.

    Raises
    ------
    NacreError
        If hardly any sample of the reflectance is valid, or there is no room for a point.
    """
    size = 1024 if nbytes < 2048 and brdf.isotropic else 2048
    samples = draw_samples(brdf, _PER_POINT * size, seed, distribution="mixed")
    angle = axis_angle(samples, brdf.isotropic, ENHANCED)
    mean = 1 + len(_scales(brdf.isotropic))
    count = (nbytes - size // 8 - (0 if brdf.isotropic else 4)) // 6 - mean
    if count < 1:
        raise NacreError(f"a Gaussian process does not fit into {nbytes} bytes")
    values = np.maximum(samples.rgb.astype(np.float64), 0.0) + _DARKEST
    weights = _importance(values, samples)[:, None]
    x = _scaled(samples.wi, samples.wo, brdf.isotropic, angle)
    design = _points(size, brdf.isotropic, angle)
    columns = weights * features(x, design, trends(design, design))
    gram, moment = columns.T @ columns, columns.T @ (weights * np.log(values))
    chosen = greedy(gram, moment, mean, count)
    chosen[mean:].sort()
    gram, moment = gram[np.ix_(chosen, chosen)], moment[chosen]
    gram += np.diag(_NOISE * np.diag(gram))
    return GaussianProcessBrdf(
        chosen[mean:] - mean,
        size,
        round_weights(gram, moment),
        isotropic=brdf.isotropic,
        angle=angle,
        name=brdf.name,
    )


def features(x: Doubles, points: Doubles, trend: Doubles) -> Doubles:
    """1, the inputs (n, k), and the kernel at each point (m, k) less its trend: (n, 1 + k + m)."""
    squares = (x**2).sum(axis=1)[:, None] + (points**2).sum(axis=1) - 2.0 * x @ points.T
    mean = np.concatenate([np.ones((len(x), 1)), x], axis=1)
    return np.concatenate([mean, _kernel(np.maximum(squares, 0.0)) - mean @ trend], axis=1)


def trends(design: Doubles, points: Doubles) -> Doubles:
    """The linear functions nearest to the kernels at points, over the design: (1 + k, m).

    Without them weights are small, so that half precision is enough.
    """
    mean = 1 + design.shape[1]
    whole = features(design, points, np.zeros((mean, len(points))))
    return np.asarray(np.linalg.lstsq(whole[:, :mean], whole[:, mean:])[0])


def greedy(gram: Doubles, moment: Doubles, first: int, count: int) -> npt.NDArray[np.int64]:
    """The first columns of a regression, and then those that lower its squared error most, each in
    its turn (orthogonal least squares: Chen, Billings and Luo 1989).

    Parameters
    ----------
    gram, moment
        Products of the columns with each other, shape (n, n), and with the values, shape (n, c).
    first
        Columns to take in any case.
    count
        Columns to choose after them.

    Returns
    -------
    array of shape (first + count,)
        Indices, in this order.
    """
    left, rest = np.diag(gram).copy(), moment.copy()
    factor = np.zeros((first + count, len(gram)))
    least, chosen = _NEW * left, np.zeros(first + count, np.int64)
    for k in range(first + count):
        gain = np.where(left > least, (rest**2).sum(axis=1) / np.maximum(left, 1e-300), -1.0)
        gain[chosen[:k]] = -2.0
        best = k if k < first else int(np.argmax(gain))
        row = gram[best] - factor[:k, best] @ factor[:k]
        row /= math.sqrt(max(row[best], 1e-300))
        rest -= row[:, None] * (rest[best] / row[best])
        left -= row * row
        factor[k], chosen[k] = row, best
    return chosen


def round_weights(gram: Doubles, moment: Doubles) -> npt.NDArray[np.float16]:
    """Weights (n, c) of a least-squares problem in half precision, rounded one after the other:
    those still to come make up for it (Babai's nearest plane).
    """
    exact = np.linalg.solve(gram, moment)
    upper = np.linalg.cholesky(gram).T
    rounded = np.zeros(exact.shape, np.float16)
    for i in range(len(exact) - 1, -1, -1):
        later = rounded[i + 1 :].astype(np.float64) - exact[i + 1 :]
        rounded[i] = exact[i] - upper[i, i + 1 :] @ later / upper[i, i]
    return rounded


def _kernel(squares: Array) -> Array:
    """|x - z|^1.5 from |x - z|^2."""
    xp = namespace(squares)
    root = xp.sqrt(squares)
    return root * xp.sqrt(root)


def _importance(values: Doubles, samples: DirectionSamples) -> Doubles:
    """How much a picture in even light changes with log f_r, shape (n,).

    Highlights above white count as much as white: under an environment only a part of the light
    reaches them.
    """
    lit = np.minimum(math.pi * values * samples.cosine[:, None], 1.0)
    return np.asarray((lit ** (1.0 / GAMMA)).mean(axis=1) / math.sqrt(len(values)))


def _points(size: int, isotropic: bool, angle: float) -> Doubles:
    """The design: half its points are dense about the mirror direction, half at grazing angles."""
    u = np.random.default_rng(0).random((4, 8 * size))
    theta_h = 0.5 * math.pi * u[0] ** 2
    phi_h = 0.0 * u[1] if isotropic else 2.0 * math.pi * u[1]
    light, view = from_rusinkiewicz_angles(
        theta_h, phi_h, 0.5 * math.pi * u[2], 2.0 * math.pi * u[3]
    )
    seen = (light[2] > 0.0) & (view[2] > 0.0)
    wi, wo = (join(w)[seen][: size // 2] for w in (light, view))
    grazing = np.random.default_rng(1).random((4, size // 2))
    rim = np.where(np.arange(size // 2) % 2, *_GRAZING)
    start = 0.0 * grazing[3] if isotropic else 2.0 * math.pi * grazing[3]
    azimuths = start, start + 2.0 * math.pi * grazing[2]
    near = (
        join(from_spherical(np.arccos(np.clip(_dense(u, rim), 1e-4, 1.0)), phi))
        for u, phi in zip(grazing[:2], azimuths, strict=True)
    )
    wi, wo = (np.concatenate(pair) for pair in zip((wi, wo), near, strict=True))
    return _scaled(wi, wo, isotropic, angle)


def _dense(u: Doubles, rim: Doubles) -> Doubles:
    """Cosines uniform in log(cos + rim)."""
    return rim * ((1.0 + rim) / rim) ** u - rim


def _scaled(wi: Floats, wo: Floats, isotropic: bool, angle: float) -> Doubles:
    """Inputs of the kernel, shape (n, k)."""
    light, view = (split(w.astype(np.float64)) for w in (wi, wo))
    inputs = network_inputs(light, view, isotropic, ENHANCED, angle)
    scales = np.array(_scales(isotropic))
    return np.asarray(np.stack(np.broadcast_arrays(*inputs), axis=1) * scales)


def _scales(isotropic: bool) -> tuple[float, ...]:
    return _SCALES if isotropic else _ANISOTROPIC_SCALES
