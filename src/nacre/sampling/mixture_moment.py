"""The second moment of a mixture of diffuse and GGX lobes, and its derivatives."""

from __future__ import annotations

import math

import numpy as np

from nacre.array import Floats
from nacre.numerics.newton import Terms
from nacre.sampling.mixture import GgxMixture, Values
from nacre.sampling.mixture_parameters import (
    MAX_FITTED_SHIFT,
    MIN_COSINE,
    ROUGHNESSES,
    bounded,
    columns,
    free_roughness,
    rounded_mixture,
)
from nacre.sampling.moment import Moment, view_pairs
from nacre.sampling.visible_normals import visible_density

_STEP = 1e-5  # of differences
_SMALL = -2.0  # logarithm of a fraction that starts small, relative to that of the cosine lobe


class MixtureMoment:
    """The second moment of a mixture, as a function of parameters that may have any value.

    They are a row for each of `cosines` (see :mod:`nacre.sampling.mixture_parameters`), for so many
    GGX lobes. For cosines and angle see :class:`GgxMixture`.
    """

    def __init__(self, moment: Moment, cosines: Values, lobes: int, angle: float | None) -> None:
        self.cosines, self.lobes, self.angle = cosines, lobes, angle
        self._half, self._view, self._z = view_pairs(moment.wo, moment.wi, angle)
        self._weights = moment.weights
        mu = moment.wo[:, 0, 2]
        self._hats = np.stack([np.interp(mu, cosines, row) for row in np.eye(len(cosines))], -1)
        self._fractions, self._roughnesses, self._shifts = columns(lobes)

    def start(self, roughness: Values) -> Floats:
        """Parameters of isotropic lobes that do not depend on the view."""
        rows = np.zeros((len(self.cosines), self._shifts.stop))
        rows[:, :2] = _SMALL
        rows[:, self._roughnesses] = np.tile([free_roughness(a) for a in roughness], 2)
        return rows.ravel()

    def part(self, free: Floats, wider: float) -> Floats:
        """Parameters with one lobe more, for a :class:`MixtureMoment` that has it: the last one in
        two halves, of which one is wider by this change of its parameters.
        """
        last = self._fractions.stop - 1 + self.lobes * np.arange(4)
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
        """The sampler for parameters, with four digits of each."""
        rows = free.reshape(len(self.cosines), -1)
        return rounded_mixture(rows, self.cosines, self.lobes, self.angle)

    def _density(self, values: Floats) -> tuple[Floats, Floats]:
        """The density (v, n) for parameters (v, c) of the views, and its derivatives (v, c, n)."""
        count = self.lobes
        slopes = np.empty((*values.shape, self._z.shape[1]))
        cosine = self._z / math.pi
        slopes[:, 0] = 0.5 / math.pi - cosine
        slopes[:, 1] = 1.5 / math.pi * self._z**2 - cosine
        for k in range(count):
            fraction, *shape = (values[:, 2 + k + j * count, None] for j in range(4))
            lobe = self._lobe(shape)
            slopes[:, 2 + k] = lobe - cosine
            for j, value in enumerate(shape):
                step = _STEP * (1.0 if j == 2 else value)
                moved = self._lobe([*shape[:j], value + step, *shape[j + 1 :]])
                slopes[:, 2 + k + (j + 1) * count] = fraction / step * (moved - lobe)
        fractions = values[:, self._fractions, None]
        return cosine + (fractions * slopes[:, self._fractions]).sum(axis=1), slopes

    def _lobe(self, shape: list[Floats]) -> Floats:
        along, across, shift = shape
        return np.asarray(visible_density(self._half, self._view, (along, across), shift))

    def _bounded(self, rows: Floats) -> tuple[Floats, Floats]:
        """Values (m, c) for free parameters (m, c), and their derivatives (m, c, c)."""
        fractions, roughnesses, shifts = bounded(rows, self.lobes)
        chain = np.zeros((*rows.shape, rows.shape[1]))
        part = fractions / (1.0 - MIN_COSINE)
        square = np.eye(fractions.shape[1]) * part[:, None] - part[:, :, None] * part[:, None]
        chain[:, self._fractions, self._fractions] = (1.0 - MIN_COSINE) * square
        low, high = np.log(ROUGHNESSES)
        place = (np.log(roughnesses) - low) / (high - low)
        slope = roughnesses * (high - low) * place * (1.0 - place)
        slope = np.concatenate([slope, MAX_FITTED_SHIFT - shifts**2 / MAX_FITTED_SHIFT], axis=1)
        index = np.arange(self._fractions.stop, rows.shape[1])
        chain[:, index, index] = slope
        return np.concatenate([fractions, roughnesses, shifts], axis=1), chain
