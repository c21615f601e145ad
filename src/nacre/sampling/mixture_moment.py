"""The second moment of a mixture of diffuse and GGX lobes, and its derivatives."""

from __future__ import annotations

import math

import numpy as np

from nacre.array import Floats
from nacre.geometry import half_vector, split
from nacre.sampling.mixture import GgxLobe, GgxMixture, Values, lobe_frame, turned
from nacre.sampling.moment import Moment
from nacre.sampling.newton import Terms
from nacre.sampling.visible_normals import visible_density

_LEAST_COSINE = 0.01
"""Share of the cosine lobe: it bounds every weight."""
_ROUGHNESS = 0.004, 1.5
"""Range of roughnesses."""
_SHIFT = 1.0
"""Largest shift."""
_STEP = 1e-5
"""Of differences."""
_SMALL = -2.0
"""Logarithm of a share that starts small, relative to that of the cosine lobe."""


class MixtureMoment:
    """The second moment as a function of parameters that may have any value.

    They are a matrix, a row for each of `cosines`: the logarithms of the shares of the uniform, the
    squared and the GGX lobes relative to that of the cosine lobe; roughnesses along and across, and
    shifts, of all lobes, through functions that keep them within bounds.

    Parameters
    ----------
    moment
        Of the material.
    cosines
        See :class:`GgxMixture`.
    lobes
        Number of GGX lobes.
    angle
        See :class:`GgxMixture`.
    """

    def __init__(self, moment: Moment, cosines: Values, lobes: int, angle: float | None) -> None:
        self.cosines, self.lobes, self.angle = cosines, lobes, angle
        wi, wo = split(moment.wi), split(moment.wo)
        axis, view = lobe_frame(wo, angle)
        self._h = turned(half_vector(wi, wo), *axis)
        self._view = view
        self._z = wi[2]
        self._weights = moment.weights
        mu = moment.wo[:, 0, 2]
        self._hats = np.stack([np.interp(mu, cosines, row) for row in np.eye(len(cosines))], -1)
        shares = 2 + lobes
        self._shares = slice(0, shares)
        self._roughnesses = slice(shares, shares + 2 * lobes)
        self._shifts = slice(shares + 2 * lobes, shares + 3 * lobes)

    def start(self, roughness: Values) -> Floats:
        """Parameters of isotropic lobes that do not depend on the view."""
        rows = np.zeros((len(self.cosines), self._shifts.stop))
        rows[:, :2] = _SMALL
        rows[:, self._roughnesses] = np.tile([_free_roughness(a) for a in roughness], 2)
        return rows.ravel()

    def part(self, free: Floats, wider: float) -> Floats:
        """Parameters with one lobe more, for a :class:`MixtureMoment` that has it: the last one in
        two halves, of which one is wider by this change of its parameters.
        """
        last = self._shares.stop - 1 + self.lobes * np.arange(4)
        rows = free.reshape(len(self.cosines), -1)
        rows = np.repeat(rows, 1 + np.isin(np.arange(rows.shape[1]), last), axis=1)
        rows[:, last[0] : last[0] + 2] -= math.log(2.0)
        rows[:, [last[1] + 2, last[2] + 3]] += wider
        return rows.ravel()

    def __call__(self, free: Floats) -> Terms:
        """Value, gradient and, near enough, Hessian.

        The curvature of the density is left out, and the square of its slope counts twice: at a
        perfect fit, where weights are proportional to the density, the first is minus one half of
        the second by Fisher's identity.
        """
        values, chain = self._bounded(free.reshape(len(self.cosines), -1))
        density, slopes = self._density(self._hats @ values)
        ratio = self._weights / density
        slopes /= density[:, None]
        gradient = -np.einsum("vn,vcn->vc", ratio, slopes)
        hessian = 2.0 * (slopes * ratio[:, None]) @ slopes.transpose(0, 2, 1)
        chain = np.einsum("vm,mcp->vcmp", self._hats, chain).reshape(*gradient.shape, -1)
        return (
            float(ratio.sum()),
            np.einsum("vc,vcp->p", gradient, chain),
            (chain.transpose(0, 2, 1) @ hessian @ chain).sum(axis=0),
        )

    def mixture(self, free: Floats) -> GgxMixture:
        """The sampler of parameters, with four digits of each."""
        values, _ = self._bounded(free.reshape(len(self.cosines), -1))
        values[:, self._shares] = values[:, self._shares].round(4)
        uniform, squared, *rest = (tuple(float(f"{x:.4g}") for x in row) for row in values.T)
        lobes = (GgxLobe(*rest[k :: self.lobes]) for k in range(self.lobes))
        return GgxMixture(tuple(lobes), uniform, squared, self.cosines, self.angle)

    def _density(self, values: Floats) -> tuple[Floats, Floats]:
        """The density (v, n) of parameters (v, c) of the views, and its derivatives (v, c, n)."""
        count = self.lobes
        slopes = np.empty((*values.shape, self._z.shape[1]))
        cosine = self._z / math.pi
        slopes[:, 0] = 0.5 / math.pi - cosine
        slopes[:, 1] = 1.5 / math.pi * self._z**2 - cosine
        for k in range(count):
            share, *shape = (values[:, 2 + k + j * count, None] for j in range(4))
            lobe = self._lobe(shape)
            slopes[:, 2 + k] = lobe - cosine
            for j, value in enumerate(shape):
                step = _STEP * (1.0 if j == 2 else value)
                moved = self._lobe([*shape[:j], value + step, *shape[j + 1 :]])
                slopes[:, 2 + k + (j + 1) * count] = share / step * (moved - lobe)
        shares = values[:, self._shares, None]
        return cosine + (shares * slopes[:, self._shares]).sum(axis=1), slopes

    def _lobe(self, shape: list[Floats]) -> Floats:
        along, across, shift = shape
        lobe: Floats = visible_density(self._h, self._view, (along, across), shift)
        return lobe

    def _bounded(self, rows: Floats) -> tuple[Floats, Floats]:
        """Values (m, c) of free parameters (m, c), and their derivatives (m, c, c)."""
        values, chain = np.empty_like(rows), np.zeros((*rows.shape, rows.shape[1]))
        powers = np.exp(np.minimum(rows[:, self._shares], 30.0))
        shares = powers / (1.0 + powers.sum(axis=1, keepdims=True))
        values[:, self._shares] = (1.0 - _LEAST_COSINE) * shares
        square = np.eye(shares.shape[1]) * shares[:, None] - shares[:, :, None] * shares[:, None]
        chain[:, self._shares, self._shares] = (1.0 - _LEAST_COSINE) * square
        low, high = np.log(_ROUGHNESS)
        place = 1.0 / (1.0 + np.exp(-rows[:, self._roughnesses]))
        values[:, self._roughnesses] = np.exp(low + (high - low) * place)
        slope = values[:, self._roughnesses] * (high - low) * place * (1.0 - place)
        shift = np.tanh(rows[:, self._shifts])
        values[:, self._shifts] = _SHIFT * shift
        slope = np.concatenate([slope, _SHIFT * (1.0 - shift**2)], axis=1)
        index = np.arange(self._shares.stop, rows.shape[1])
        chain[:, index, index] = slope
        return values, chain


def _free_roughness(roughness: float) -> float:
    low, high = np.log(_ROUGHNESS)
    place = (math.log(roughness) - low) / (high - low)
    return math.log(place / (1.0 - place))
