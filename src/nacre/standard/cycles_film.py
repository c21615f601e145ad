"""Interference in a thin film as in Cycles: three orders, on dielectrics and on metals.

Belcour and Barla 2017, "A Practical Extension to Microfacet Theory for the Modeling of Varying
Iridescence", equations 6 to 10, in the form of Blender 5.0 (intern/cycles/kernel/closure/
bsdf_util.h, `fresnel_iridescence`): the spectrum enters through the Fourier transforms of the
matching functions for Rec. 709, each of which is 1 at a path difference of 0.
"""

from __future__ import annotations

import math

from nacre.array import Array, Components, namespace
from nacre.standard.metal_fresnel import metal, metal_dip
from nacre.standard.parameter_math import of_numbers
from nacre.standard.thin_film import amplitudes, refracted

_ORDERS = 3

_GAUSSIANS = (
    (1.6538, 0.0777, (1.4684, -0.2805, -0.0037)),
    (1.7980, 0.1024, (-0.2223, 1.1186, -0.1372)),
    (1.9595, 0.0811, (-0.3214, 0.2729, -0.0054)),
    (2.2111, 0.1060, (0.1337, -0.1564, 1.2184)),
    (2.1708, 0.0336, (-0.0584, 0.0453, -0.0722)),
)
"""Wave number and deviation, in 1/um, and weights in red, green and blue, fitted to the transforms
of the CIE 1931 functions in linear Rec. 709, each over its area: 0.3 % off at most
(lab/studies/parity/principled_tables.py)."""


class Film:
    """A film in air under light at one angle, to be put on a material.

    The thickness in nanometers and the refractive index are at least 1; the cosine is that between
    light and normal.
    """

    def __init__(self, thickness: Array, index: Array, cosine: Array) -> None:
        self._xp = namespace(cosine)
        self._index = index
        self._inside = refracted(cosine, index)
        self._outer = amplitudes(cosine, self._inside, index)
        self._fringes = _fringes((2.0 * thickness) * index * self._inside)

    def on_dielectric(self, index: Array) -> Components:
        """Reflectance in red, green and blue over a dielectric with an index of at least 1."""
        relative = index / self._index
        sine = (1.0 - self._inside * self._inside) / (relative * relative)
        below = self._xp.sqrt(self._xp.maximum(1.0 - sine, 1e-12))
        inner = amplitudes(self._inside, below, relative)
        base: Array = 0.0
        weights: list[Array] = [0.0] * _ORDERS
        for a, b in zip(self._outer, inner, strict=True):
            outer, round_trip = a * a, -1.0 * a * b
            through = 1.0 - outer
            all_orders = through * through * b * b / (1.0 - round_trip * round_trip)
            base = base + 0.5 * (outer + all_orders)
            # Each polarization has weight 1/2, and each order 2.
            weight = all_orders - through
            for k in range(_ORDERS):
                weight = weight * round_trip
                weights[k] = weights[k] + weight
        red, green, blue = (
            self._clipped(
                base + sum(w * f[0][k] for w, f in zip(weights, self._fringes, strict=True))
            )
            for k in range(3)
        )
        return red, green, blue

    def on_metal(self, channel: int, normal: Array, at_82: Array) -> Array:
        """Reflectance in one channel over a metal, from its reflectances in air at 0 and 82
        degrees.

        The metal's complex index follows Gulbrandsen 2014, "Artist Friendly Metallic Fresnel".
        """
        r = of_numbers("minimum", normal, 0.999)
        root = of_numbers("sqrt", r)
        low, high = (1.0 - r) / (1.0 + r), (1.0 + root) / (1.0 - root)
        n = high + (low - high) * at_82
        k2 = (r * (n + 1.0) * (n + 1.0) - (n - 1.0) * (n - 1.0)) / (1.0 - r)
        k2 = of_numbers("maximum", k2, 0.0)
        film2 = self._index * self._index
        less, more = n - self._index, n + self._index
        inside_normal = (less * less + k2) / (more * more + k2)
        inner = metal(self._inside, inside_normal, metal_dip(inside_normal, at_82))
        total: Array = 0.0
        phasors = self._phasors(n, of_numbers("sqrt", k2), film2)
        for amplitude, phasor in zip(self._outer, phasors, strict=True):
            outer = amplitude * amplitude
            through = 1.0 - outer
            all_orders = through * through * inner / (1.0 - outer * inner)
            size = amplitude * self._xp.sqrt(inner)
            total = total + 0.5 * (outer + all_orders)
            weight, real, imaginary = all_orders - through, 1.0, 0.0
            for found in self._fringes:
                weight = weight * size
                real, imaginary = (
                    real * phasor[0] - imaginary * phasor[1],
                    real * phasor[1] + imaginary * phasor[0],
                )
                total = total + weight * (real * found[0][channel] + imaginary * found[1][channel])
        return self._clipped(total)

    def _phasors(self, n: Array, k: Array, film2: Array) -> list[tuple[Array, Array]]:
        """Cosine and sine of the phase of light that a metal reflects inside the film, by
        polarization.

        Parallel, then perpendicular; multiplied by the amplitude at the film's upper side, this is
        the phase of the round trip (Born and Wolf, "Principles of Optics", section 14.4.1).
        """
        xp, cosine = self._xp, self._inside
        difference, product = n * n - k * k, 2.0 * n * k
        t = difference - film2 * (1.0 - cosine * cosine)
        length = xp.sqrt(t * t + product * product)
        u, v = (xp.sqrt(xp.maximum(0.5 * (length + s * t), 0.0)) for s in (1.0, -1.0))
        parts = (n * n + k * k) * cosine
        twice = 2.0 * self._index * cosine
        return [
            self._unit(film2 * length - parts * parts, twice * (difference * v - product * u)),
            self._unit(film2 * cosine * cosine - length, -1.0 * twice * v),
        ]

    def _unit(self, real: Array, imaginary: Array) -> tuple[Array, Array]:
        length = self._xp.sqrt(self._xp.maximum(real * real + imaginary * imaginary, 1e-24))
        return real / length, imaginary / length

    def _clipped(self, value: Array) -> Array:
        return self._xp.minimum(self._xp.maximum(value, 0.0), 1.0)


def _fringes(path: Array) -> list[tuple[Components, Components]]:
    """For each order, the matching functions' response to a path difference in nanometers.

    It has a real and an imaginary part for each channel.
    """
    xp = namespace(path)
    micrometers = 1e-3 * path
    square = micrometers * micrometers
    sums: list[list[list[Array]]] = [[[0.0] * 3, [0.0] * 3] for _ in range(_ORDERS)]
    for place, deviation, weights in _GAUSSIANS:
        angle = (2.0 * math.pi * place) * micrometers
        cosine, sine = xp.cos(angle), xp.sin(angle)
        damping = xp.exp((-2.0 * math.pi * math.pi * deviation * deviation) * square)
        fourth = damping * damping * damping * damping
        ninth = fourth * fourth * damping
        real, imaginary = cosine, sine
        for order, envelope in enumerate((damping, fourth, ninth)):
            if order:
                real, imaginary = (
                    real * cosine - imaginary * sine,
                    real * sine + imaginary * cosine,
                )
            for part, value in zip(sums[order], (real, -1.0 * imaginary), strict=True):
                for k, weight in enumerate(weights):
                    part[k] = part[k] + weight * envelope * value
    return [((a[0], a[1], a[2]), (b[0], b[1], b[2])) for a, b in sums]
