"""Diffuse lobes and visible GGX normals that change with the view."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping
from dataclasses import astuple, dataclass
from typing import Any, TypeAlias

from nacre.array import Array, Components, namespace
from nacre.brdf import Sampler
from nacre.compile.data import computed
from nacre.geometry import azimuth, half_vector, reflect
from nacre.sampling.visible_normals import MIN_ROUGHNESS, sample_visible, visible_density

Values: TypeAlias = tuple[float, ...]
"""A value for each of the cosines of a mixture; linear between them, constant beyond."""

MAX_LOBES, MAX_COSINES = 8, 16  # the code of a renderer grows with these
MAX_ROUGHNESS, MAX_SHIFT = 4.0, 2.0
_IN_FILES = "share", "roughness", "across", "shift"  # the fields of a lobe
_ROUNDING = 1e-6  # how far fractions may add up to more than 1
_TINY = 1e-30


@dataclass(frozen=True)
class GgxLobe:
    """Mirror directions of visible GGX normals; see :mod:`nacre.sampling.visible_normals`."""

    fraction: Values  # probability of the lobe, in [0, 1]
    roughness: Values  # alpha along the x axis of the lobe, in [MIN_ROUGHNESS, MAX_ROUGHNESS]
    across: Values  # alpha across it, likewise
    shift: Values  # mean slope of the normals along x, in roughnesses, within MAX_SHIFT


@dataclass(frozen=True)
class GgxMixture(Sampler):
    """A diffuse lobe and lobes of visible GGX normals, all of which depend on the view's cosine.

    The axes of the lobes turn with the view: x points to where it comes from. So they follow what
    isotropic materials do at grazing angles, where highlights grow narrow across the plane of
    incidence and leave the mirror direction. The diffuse lobe is a polynomial in cos(theta_i) of
    degree 2: a mixture of the densities 1 / (2 pi) (`uniform`), 3 cos(theta_i)^2 / (2 pi)
    (`squared`), and for the rest cos(theta_i) / pi. What falls below the horizon has density 0: the
    density integrates to less than one at grazing views.

    Raises ValueError if a parameter is out of bounds or does not have one value for each cosine.
    """

    kind = "diffuse + GGX"

    lobes: tuple[GgxLobe, ...]
    uniform: Values = (0.0,)  # probability
    squared: Values = (0.0,)  # probability
    cosines: Values = (1.0,)  # of the views at which all these are given, increasing, in [0, 1]
    angle: float | None = None
    """Azimuth of the lobes' x axis in radians, where it does not turn with the view: for
    anisotropic materials."""

    def __post_init__(self) -> None:
        if not 1 <= len(self.lobes) <= MAX_LOBES or not 1 <= len(self.cosines) <= MAX_COSINES:
            raise ValueError(f"1 to {MAX_LOBES} lobes and 1 to {MAX_COSINES} cosines are possible")
        if any(a >= b for a, b in itertools.pairwise(self.cosines)):
            raise ValueError(f"cosines must increase, got {self.cosines}")
        for name in ("cosines", "uniform", "squared"):
            self._check(name, getattr(self, name), 0.0, 1.0)
        for lobe in self.lobes:
            self._check("fraction", lobe.fraction, 0.0, 1.0)
            self._check("roughness", lobe.roughness, MIN_ROUGHNESS, MAX_ROUGHNESS)
            self._check("across", lobe.across, MIN_ROUGHNESS, MAX_ROUGHNESS)
            self._check("shift", lobe.shift, -MAX_SHIFT, MAX_SHIFT)
        fractions = [self.uniform, self.squared, *(lobe.fraction for lobe in self.lobes)]
        if any(sum(at) > 1.0 + _ROUNDING for at in zip(*fractions, strict=True)):
            raise ValueError("fractions must add up to 1 at most")
        if self.angle is not None and not -math.pi <= self.angle <= math.pi:
            raise ValueError(f"angle must lie in [-pi, pi], got {self.angle}")

    def _check(self, name: str, values: Values, low: float, high: float) -> None:
        if len(values) != len(self.cosines):
            raise ValueError(f"{name} must have {len(self.cosines)} values, got {len(values)}")
        if not all(low <= value <= high for value in values):
            raise ValueError(f"{name} must lie in [{low:g}, {high:g}], got {values}")

    def describe(self) -> dict[str, Any]:
        lobes = [dict(zip(_IN_FILES, astuple(lobe), strict=True)) for lobe in self.lobes]
        return {**super().describe(), "lobes": lobes}

    @classmethod
    def from_description(cls, description: Mapping[str, Any]) -> GgxMixture:

        def values(part: Mapping[str, Any], name: str) -> Values:
            return tuple(float(value) for value in part[name])

        lobes = (
            GgxLobe(*(values(lobe, name) for name in _IN_FILES)) for lobe in description["lobes"]
        )
        uniform, squared, cosines = (
            values(description, name) for name in ("uniform", "squared", "cosines")
        )
        angle = None if description["angle"] is None else float(description["angle"])
        return cls(tuple(lobes), uniform, squared, cosines, angle)

    def __str__(self) -> str:
        def span(values: Values) -> str:
            low, high = f"{min(values):.2g}", f"{max(values):.2g}"
            return low if low == high else f"{low}-{high}"

        lobes = (
            f"{span(tuple(100.0 * s for s in lobe.fraction))} % GGX normals of roughness "
            f"{span(lobe.roughness + lobe.across)}"
            for lobe in self.lobes
        )
        return ", ".join([*lobes, "else diffuse"])

    def sample_components(self, wo: Components, u: Components) -> tuple[Components, Array]:
        """See :class:`nacre.brdf.Sampler`; u[0] selects the lobe."""
        xp = namespace(*wo, *u)
        at, (cos, sin), view = self._interpolation(wo), *lobe_frame(wo, self.angle)
        # One normal is drawn, with the parameters of the lobe that u[0] selects.
        *others, last = self.lobes
        shape = _shape(last, at)
        bound: Array = 0.0
        bounds = [bound := bound + at(lobe.fraction) for lobe in self.lobes]
        for lobe, below in zip(reversed(others), bounds[-2::-1], strict=True):
            pairs = zip(_shape(lobe, at), shape, strict=True)
            along, across, shift = (xp.where(u[0] < below, *pair) for pair in pairs)
            shape = along, across, shift
        normal = sample_visible(view, u[1], u[2], shape[:2], shape[2])
        mirrored = in_frame(reflect(view, normal), cos, -1.0 * sin)

        uniform = bound + at(self.uniform)
        squared = uniform + at(self.squared)
        cube_root = xp.exp(xp.log(xp.maximum(u[1], _TINY)) * (1.0 / 3.0))
        z = xp.where(u[0] < uniform, u[1], xp.where(u[0] < squared, cube_root, xp.sqrt(u[1])))
        radius, phi = xp.sqrt(xp.maximum(1.0 - z * z, 0.0)), 2.0 * math.pi * u[2]
        diffuse = radius * xp.cos(phi), radius * xp.sin(phi), z
        x, y, z = (xp.where(u[0] < bound, m, d) for m, d in zip(mirrored, diffuse, strict=True))
        return (x, y, z), self.pdf_components((x, y, z), wo)

    def pdf_components(self, wi: Components, wo: Components) -> Array:
        xp = namespace(*wi, *wo)
        at, (cos, sin), view = self._interpolation(wo), *lobe_frame(wo, self.angle)
        h = in_frame(half_vector(wi, wo), cos, sin)
        uniform, squared = at(self.uniform), at(self.squared)
        cosine = 1.0 - uniform - squared
        density: Array = 0.0
        for lobe in self.lobes:
            fraction, (along, across, shift) = at(lobe.fraction), _shape(lobe, at)
            density = density + fraction * visible_density(h, view, (along, across), shift)
            cosine = cosine - fraction
        cosine = xp.maximum(cosine + 0.0 * wo[2], 0.0)
        diffuse = uniform + wi[2] * (2.0 * cosine + 3.0 * squared * wi[2])
        density = density + diffuse / (2.0 * math.pi)
        visible = (wi[2] > 0.0) & (wo[2] > 0.0)
        return xp.where(visible, density, 0.0 * density)

    def _interpolation(self, wo: Components) -> Callable[[Values], Array]:
        """A function from a parameter to its value for a view."""
        xp = namespace(*wo)
        steps = [
            xp.minimum(xp.maximum((wo[2] - low) * (1.0 / (high - low)), 0.0), 1.0)
            for low, high in itertools.pairwise(self.cosines)
        ]

        def at(values: Values) -> Array:
            value: Array = values[0]
            for step, (low, high) in zip(steps, itertools.pairwise(values), strict=True):
                # Numbers may be data of a kernel, and formulas do not depend on their values.
                if xp.library == "trace" or type(low) is not float or low != high:
                    value = value + (high - low) * step
            return value

        return at


def _shape(lobe: GgxLobe, at: Callable[[Values], Array]) -> Components:
    """Roughness along and across, and shift, for a view."""
    return at(lobe.roughness), at(lobe.across), at(lobe.shift)


def lobe_frame(wo: Components, angle: float | None) -> tuple[tuple[Array, Array], Components]:
    """Cosine and sine of the azimuth of the lobes' x axis, and the view in their frame."""
    if angle is None:
        cos, sin, sin_theta = azimuth(wo)
        return (cos, sin), (sin_theta, 0.0, wo[2])
    axis = computed("cos", math.cos, angle), computed("sin", math.sin, angle)
    return axis, in_frame(wo, *axis)


def in_frame(w: Components, cos: Array, sin: Array) -> Components:
    """`w` in a frame that is rotated about z by an angle with this cosine and sine."""
    return cos * w[0] + sin * w[1], cos * w[1] - sin * w[0], w[2]
