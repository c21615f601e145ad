"""A learned sampler: a small network maps normal numbers to directions.

After Wu et al. 2025, "Neural BRDF Importance Sampling by Reparameterization" (arXiv 2505.08998): a
network maps two normal numbers and the view to a direction, and the density follows from its
Jacobian. Nothing makes the map invertible. So a sample's density is known, that of another
direction is not, and where the map folds or leaves a part of the hemisphere out, estimates are
biased.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from nacre.array import Array, Components, Weights, namespace
from nacre.brdf import Sampler
from nacre.errors import NacreError
from nacre.sampling.mixture import in_frame, lobe_frame

FREQUENCIES = 4
INPUTS = 1 + 2 * FREQUENCIES + 2
_SMALLEST = 1e-12  # number whose logarithm is taken, cosine, and density


class Reparameterized(Sampler):
    """Directions of an isotropic material by a network of sigmoid linear units.

    Inputs are the sine of the view's polar angle, sines and cosines of pi times it at
    :data:`FREQUENCIES` octaves, and two normal numbers. Outputs are the two tangential components
    of a vector and, through a softplus, the normal one; its length is then made 1. Axes turn with
    the view.

    Parameters
    ----------
    layers
        Weights of shape (inputs, outputs) and biases of each layer; the first has :data:`INPUTS`
        inputs, the last three outputs.
    """

    def __init__(self, layers: Sequence[tuple[Weights, Weights]]) -> None:
        self.layers = tuple(layers)

    def __str__(self) -> str:
        return f"a network of {sum(w.size + b.size for w, b in self.layers):,} numbers"

    def sample_components(self, wo: Components, u: Components) -> tuple[Components, Array]:
        xp = namespace(*wo, *u)
        (cos, sin), view = lobe_frame(wo, None)
        z = normal_numbers(u)
        inputs = [*encoded(view[0] + 0.0 * u[1]), *z]
        values, along, across = self._network(inputs)
        wi, area = onto_hemisphere(values, along, across)
        density = wi[2] * xp.exp(-0.5 * (z[0] * z[0] + z[1] * z[1])) * (0.5 / math.pi)
        density = density / xp.maximum(xp.abs(area), _SMALLEST)
        x, y, up = in_frame(wi, cos, -1.0 * sin)
        return (x, y, up), xp.where((up > 0.0) & (wo[2] > 0.0), density, 0.0 * density)

    def pdf_components(self, wi: Components, wo: Components) -> Array:
        raise NacreError("the density of a reparameterized sampler is known where it samples only")

    def _network(self, inputs: list[Array]) -> tuple[list[Array], list[Array], list[Array]]:
        """Outputs and their derivatives by the last two inputs."""
        xp = namespace(*inputs)
        weights, biases = self.layers[0]
        values = xp.dense(inputs, weights, biases)
        one = 0.0 * values[0] + 1.0
        tangents = [[one * w for w in row] for row in weights[-2:].tolist()]
        for weights, biases in self.layers[1:]:
            gates = [1.0 / (1.0 + xp.exp(-1.0 * v)) for v in values]
            slopes = [g * (1.0 + v * (1.0 - g)) for g, v in zip(gates, values, strict=True)]
            hidden = [g * v for g, v in zip(gates, values, strict=True)]
            moved = [[s * t for s, t in zip(slopes, ts, strict=True)] for ts in tangents]
            none = np.zeros_like(biases)
            values = xp.dense(hidden, weights, biases)
            tangents = [xp.dense(ts, weights, none) for ts in moved]
        return values, tangents[0], tangents[1]


def normal_numbers(u: Components) -> tuple[Array, Array]:
    """Two normal numbers from the last two of three in [0, 1) (Box and Muller 1958)."""
    xp = namespace(*u)
    radius = xp.sqrt(-2.0 * xp.log(xp.maximum(1.0 - u[1], _SMALLEST)))
    phi = 2.0 * math.pi * u[2]
    return radius * xp.cos(phi), radius * xp.sin(phi)


def encoded(sine: Array) -> list[Array]:
    """What the network knows about a view."""
    xp = namespace(sine)
    angles = [math.pi * 2.0**octave * sine for octave in range(FREQUENCIES)]
    return [sine, *(f(angle) for angle in angles for f in (xp.sin, xp.cos))]


def onto_hemisphere(
    values: Sequence[Array], along: Sequence[Array], across: Sequence[Array]
) -> tuple[Components, Array]:
    """A direction from a network's outputs, and the signed projected area that a square of its
    random numbers becomes, from the outputs' derivatives by them.
    """
    xp = namespace(*values)
    positive = xp.maximum(values[2], 0.0)
    power = xp.exp(-1.0 * xp.abs(values[2]))
    normal = positive + xp.log(1.0 + power) + _SMALLEST
    gate = xp.where(values[2] > 0.0, 1.0, power) / (1.0 + power)
    inverse = 1.0 / xp.sqrt(values[0] * values[0] + values[1] * values[1] + normal * normal)
    x, y, z = values[0] * inverse, values[1] * inverse, normal * inverse
    sides = []
    for side in (along, across):
        a, b, c = side[0], side[1], gate * side[2]
        shift = x * a + y * b + z * c
        sides.append((inverse * (a - x * shift), inverse * (b - y * shift)))
    (a, b), (c, d) = sides
    return (x, y, z), a * d - b * c
