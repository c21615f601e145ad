"""Any isotropic reflectance on the grid of an MDL file.

A value taken at the center of each cell would miss a narrow highlight or widen it. The values found
here minimize the Kullback-Leibler divergence of what :class:`MbsdfBrdf` interpolates from f_r
cos(theta_i) cos(theta_o), over points within the cells, by the multiplicative steps of Richardson
1972, "Bayesian-Based Iterative Method of Image Restoration", and Lucy 1974, "An Iterative Technique
for the Rectification of Observed Distributions": none becomes negative.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.errors import FormatError
from nacre.geometry import from_spherical, join
from nacre.measured.mbsdf_table import MbsdfBrdf, Resolution, nodes_around
from nacre.sampling import check_isotropic

_FINEST = 4
"""Points along each side of a cell. Two or three lose up to 5 dB in pictures of the sharpest of
seven measured materials; five gain 2 dB there, nothing elsewhere, and take ten times as long."""
_MOST_POINTS = 1 << 25  # all points: they take 400 MB
_STEPS = 4  # after which pictures change by less than 0.3 dB
_LARGEST = 1e30
_TINY = 1e-30

_Single = npt.NDArray[np.float32]


def tabulate(brdf: Brdf, resolution: Resolution | None = None) -> MbsdfBrdf:
    """Any isotropic reflectance on a grid like that of an MDL file; see :class:`Resolution`.

    Points where `brdf` is not known or not finite do not count; a node that only such points are
    around is 0. Azimuths are on both sides of the light in turn. The table of a material that is
    reciprocal by construction is so too.

    Raises a FormatError if `brdf` is anisotropic, and a NacreError if it only says that it is
    isotropic.
    """
    if not brdf.isotropic:
        raise FormatError(f"{brdf.name or 'this material'}: MDL holds isotropic reflectance only")
    check_isotropic(brdf)
    resolution = resolution or Resolution()
    cells = resolution.theta**2 * resolution.phi
    finest = max(n for n in range(1, _FINEST + 1) if n == 1 or n**3 * cells <= _MOST_POINTS)
    theta, phi = (_points(n, finest) for n in (resolution.theta, resolution.phi))
    polar, azimuths = _blends(theta, resolution.theta), _blends(phi, resolution.phi)
    theta, phi = theta * (0.5 * math.pi / resolution.theta), phi * (math.pi / resolution.phi)
    phi[1::2] *= -1.0
    around = (
        _averages(polar, np.cos(theta) * np.sin(theta)),
        _averages(azimuths, np.ones(len(phi))),
    )
    f_r, known = _values(brdf, theta, phi)

    found = _gathered(lambda row: f_r[row], *around)
    if not known.all():
        found /= np.maximum(_gathered(lambda row: known[row], *around), _TINY)
    for _ in range(_STEPS if finest > 1 else 0):
        views = np.tensordot(polar, np.matmul(azimuths, found), (1, 1))

        def ratios(row: int, views: _Single = views) -> _Single:
            nodes = np.flatnonzero(polar[row])
            table = np.tensordot(polar[row, nodes], views[:, nodes], (0, 1))
            return np.where(known[row], f_r[row] / np.maximum(table, _TINY), np.float32(1.0))

        found *= _gathered(ratios, *around)
    if brdf.physical:
        found = np.float32(0.5) * (found + found.swapaxes(0, 1))
    return MbsdfBrdf(found, brdf.name)


def _points(count: int, finest: int) -> Floats:
    return (np.arange(count * finest) + 0.5) / finest


def _blends(points: Floats, count: int) -> _Single:
    """Weights of the nodes in what is interpolated at points, shape (points, nodes)."""
    weights = np.zeros((len(points), count), np.float32)
    for node, weight in nodes_around(points, count):
        np.add.at(weights, (np.arange(len(points)), node), weight)
    return weights


def _averages(blends: _Single, measure: Floats) -> _Single:
    """Weights of points in the averages around nodes, shape (nodes, points)."""
    weights = blends.T * measure
    return np.asarray(weights / weights.sum(axis=1, keepdims=True), np.float32)


def _values(brdf: Brdf, theta: Floats, phi: Floats) -> tuple[_Single, npt.NDArray[np.bool_]]:
    """f_r, 0 where it is not known, and where it is: (theta_in, theta_out, phi, 3) and (..., 1)."""
    shape = len(theta), len(theta), len(phi)
    f_r, known = np.empty((*shape, 3), np.float32), np.empty((*shape, 1), bool)
    wo = join(from_spherical(theta[:, None], phi)).astype(np.float32)
    for row, angle in enumerate(theta):
        wi = join(from_spherical(angle, 0.0)).astype(np.float32)
        values = brdf.eval(wi, wo)
        known[row, ..., 0] = np.isfinite(values).all(axis=-1) & brdf.valid(wi, wo)
        f_r[row] = np.where(known[row], np.minimum(values, _LARGEST), 0.0)
    return f_r, known


def _gathered(
    values: Callable[[int], _Single | npt.NDArray[np.bool_]], polar: _Single, azimuths: _Single
) -> _Single:
    """Averages around nodes, of values given for one polar angle of the light at a time.

    Values have shape (theta_out, phi, channels) at the points, for the number of a polar angle; for
    `polar` and `azimuths` see :func:`_averages`.
    """
    found: _Single | None = None
    near = csr_array(polar)  # few points are around a node
    for row, weights in enumerate(polar.T):
        own = values(row)
        average = (near @ own.reshape(len(own), -1)).reshape(-1, *own.shape[1:])
        average = np.matmul(azimuths, average)
        if found is None:
            found = np.zeros((len(polar), *average.shape), np.float32)
        nodes = np.flatnonzero(weights)
        found[nodes] += weights[nodes, None, None, None] * average
    assert found is not None
    return found
