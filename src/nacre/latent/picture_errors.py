"""How far a material is from another one, as pictures of both would show it."""

from __future__ import annotations

import numpy as np

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.color import GAMMA
from nacre.latent.directions import isotropic_values, shared_directions
from nacre.latent.recipes import GAIN
from nacre.sampling.lit_views import lit_views

_SINGLE = 2048  # directions of the first kind: a code has a few dozen values
_SEEN = 10.0  # weight of the mean error of what views see, beside that of single directions
_DARK = 1e-4  # added to what views see: at black, the gamma curve has no derivative


class PictureErrors:
    """Errors of two kinds, by which the code of an isotropic material is found.

    The first are errors of log(1 + 30 f cos theta_i) at single directions; the second those of
    radiance to the power 1 / 2.2 at views that see more of the material than one direction, under
    an even sky and under lamps (:func:`lit_views`). The first alone leaves errors of one sign,
    which add up in such light.

    Raises FormatError if `brdf` is anisotropic, NacreError if it is known at none of the
    directions, which the seed chooses.
    """

    def __init__(self, brdf: Brdf, seed: int = 0) -> None:
        self._lit = lit_views(seed)
        single = shared_directions(_SINGLE, seed)
        pairs = zip(single, (self._lit.wi, self._lit.wo), strict=True)
        wi, wo = (np.concatenate([one, lit.reshape(-1, 3)]) for one, lit in pairs)
        f_r = isotropic_values(brdf, wi, wo)
        known = f_r[:, 0] >= 0.0
        count = int(known[:_SINGLE].sum())
        self._single = slice(count)
        self._lit_known = known[_SINGLE:].reshape(self._lit.wi.shape[:2])
        self.wi, self.wo = wi[known], wo[known]  # directions to compare at, shapes (n, 3)
        f_r = np.maximum(f_r[known], 0.0)
        self._weight = GAIN * self.wi[self._single, 2:]
        self._target = np.log1p(f_r[self._single] * self._weight)
        self._seen = self._displayed(f_r)
        self._weight_of_views = _SEEN * self._target.size / self._seen.size

    def errors(self, f_r: Floats) -> Floats:
        """Errors (m,) of f_r in 1/sr at the directions, shape (n, 3).

        Those of the second kind weigh ten times as much, as a whole. Negative values count as 0 in
        them, and by their size in the first.
        """
        u = f_r[self._single] * self._weight
        single = np.copysign(np.log1p(np.abs(u)), u) - self._target
        seen = self._weight_of_views * (self._displayed(f_r) - self._seen)
        return np.concatenate([single.reshape(-1), seen.reshape(-1)])

    def slopes(self, f_r: Floats, rates: Floats) -> Floats:
        """Derivatives of the errors, shape (k, m), for those of f_r, shape (k, n, 3)."""
        u = f_r[self._single] * self._weight
        single = rates[:, self._single] * (self._weight / (1.0 + np.abs(u)))
        radiance = self._lit.radiance(self._on_lit_views(np.maximum(f_r, 0.0)))
        slope = self._weight_of_views * (1.0 / GAMMA) * (radiance + _DARK) ** (1.0 / GAMMA - 1.0)
        if f_r.min() < 0.0:
            rates = np.where(f_r > 0.0, rates, 0.0)
        seen = self._lit.radiance(self._on_lit_views(rates)) * slope
        return np.concatenate([part.reshape(len(rates), -1) for part in (single, seen)], axis=1)

    def _displayed(self, f_r: Floats) -> Floats:
        seen: Floats = self._lit.radiance(self._on_lit_views(np.maximum(f_r, 0.0))) + _DARK
        return seen ** (1.0 / GAMMA)

    def _on_lit_views(self, values: Floats) -> Floats:
        """Values at the directions of the lit views, (..., v, n, 3); 0 where not known."""
        lit = values[..., self._single.stop :, :]
        if self._lit_known.all():
            return lit.reshape(*values.shape[:-2], *self._lit.wi.shape)
        found = np.zeros((*values.shape[:-2], *self._lit.wi.shape), values.dtype)
        found[..., self._lit_known, :] = lit
        return found
