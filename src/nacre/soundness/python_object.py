"""Any Python object with the methods of a sampled reflectance."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.errors import NacreError
from nacre.geometry import join, split
from nacre.soundness.result import NotApplicableError
from nacre.soundness.subject import Drawn, Evaluate, Slope, Subject

STEP = 1e-4
"""Step of differences of directions in radians, for float64."""


class ObjectSubject(Subject):
    """An object with `eval`, and perhaps `sample`, `pdf`, `gradient` and `variants`.

    Parameters
    ----------
    material
        Its methods take NumPy arrays of unit directions in the local frame, shape (n, 3):

        - `eval(wi, wo)` gives f_r in 1/sr without the cosine, shape (n,) or (n, channels);
        - `sample(wo, u)`, with `u` in [0, 1) of shape (n, 3), gives `wi` and their densities, and
          perhaps weights f_r cos(theta_i) / pdf;
        - `pdf(wi, wo)` gives densities in 1/sr over solid angle, shape (n,);
        - `gradient(wi, wo)` gives the derivative of the sum of channels with respect to the
          components of `wi`, shape (n, 3);
        - `variants()` gives other functions like `eval`, by name.

        Its attributes `name`, `isotropic` and `by_design` say what they do in :class:`Subject`.

    Raises
    ------
    NacreError
        If it has no method `eval`.
    """

    def __init__(self, material: Any) -> None:
        if not callable(getattr(material, "eval", None)):
            raise NacreError(f"{type(material).__name__}: has no method eval(wi, wo) to check")
        self._material = material
        self.name = str(getattr(material, "name", "") or type(material).__name__)
        self.isotropic = bool(getattr(material, "isotropic", False))
        self.by_design = dict(getattr(material, "by_design", {}))

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        return _channels(self._material.eval(wi, wo), len(wi), "eval")

    def sample(self, wo: Floats, u: Floats) -> Drawn:
        wi, pdf, *weight = self._method("sample", "it has no sampler")(wo, u)
        given = _channels(weight[0], len(u), "the weight of sample") if weight else None
        return Drawn(np.asarray(wi, float), np.asarray(pdf, float), given)

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        return np.asarray(self._method("pdf", "it has no density")(wi, wo), float)

    def slopes(self) -> Sequence[Slope]:
        gradient = self._method("gradient", "it has no derivatives")

        def derivative(wi: Floats, wo: Floats) -> Floats:
            slope = np.asarray(gradient(wi, wo), float)
            return np.asarray((slope * across(wi)).sum(axis=1))

        return [Slope("the direction to the light", STEP, self._moved, derivative)]

    def _moved(self, wi: Floats, wo: Floats, step: float) -> Floats:
        return np.asarray(self.eval(moved(wi, step), wo).sum(axis=1))

    def variants(self) -> Mapping[str, Evaluate]:
        found = self._method("variants", "there is one way to evaluate it")()
        return {str(name): partial(_evaluated, function) for name, function in found.items()}

    def _method(self, name: str, reason: str) -> Callable[..., Any]:
        method = getattr(self._material, name, None)
        if not callable(method):
            raise NotApplicableError(reason)
        return method  # type: ignore[no-any-return]


def _evaluated(function: Callable[..., Any], wi: Floats, wo: Floats) -> Floats:
    return _channels(function(wi, wo), len(wi), "a variant")


def _channels(values: Any, count: int, what: str) -> Floats:
    """Values as an array of shape (n, channels); NacreError if they are of another shape."""
    found = np.asarray(values, float)
    if found.ndim not in (1, 2) or len(found) != count:
        raise NacreError(
            f"{what} gives values of shape {found.shape} for {count} pairs; expected (n,) or "
            "(n, channels)"
        )
    return found.reshape(count, -1)


def across(wi: Floats) -> Floats:
    """A unit direction across each, shape (n, 3), along which derivatives are taken."""
    axis = np.cross(wi, np.array([0.48, 0.6, 0.64]))
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    return np.asarray(axis / np.maximum(length, 1e-12))


def moved(wi: Floats, step: float) -> Floats:
    """Directions turned by an angle in radians along :func:`across`, kept above the horizon."""
    turned = np.cos(step) * wi + np.sin(step) * across(wi)
    x, y, z = split(turned)
    return join((x, y, np.maximum(z, 1e-9)))
