"""What a network sees of a pair of directions."""

from __future__ import annotations

from nacre.array import Array, Components, namespace
from nacre.errors import NacreError
from nacre.geometry import (
    half_difference,
    half_vector,
    isotropic,
    stereographic,
    to_half_frame,
)

PAPER, ENHANCED, STEREOGRAPHIC = "paper", "enhanced", "stereographic"
RECIPROCAL = "reciprocal"
INPUTS = (PAPER, ENHANCED, STEREOGRAPHIC, RECIPROCAL)
"""Names of the parametrizations of a network's inputs."""

LARGEST_INPUT = 1.01  # bound of the magnitude of every input

_HIGHLIGHT = 1e-4  # added to sin^2 theta_h before its logarithm: below .6 degrees all look alike
_HORIZON = 0.01  # added to cosines before their logarithm
_RIM = 0.015  # cosine below which all directions to the horizon look alike to physical networks
_TINY = 1e-30


def input_count(inputs: str, rotate_half_vector: bool) -> int:
    """How many numbers :func:`network_inputs` gives; NacreError where the name is unknown."""
    if inputs not in INPUTS:
        raise NacreError(f"unknown inputs {inputs!r}, expected one of {', '.join(INPUTS)}")
    if inputs == STEREOGRAPHIC:
        return 4
    return 6 if inputs == PAPER or rotate_half_vector else 7


def rotates_half_vector(inputs: str, isotropic: bool) -> bool:
    """Whether a network rotates h to phi_h = 0 where it is fitted to a material that is isotropic.

    One with stereographic inputs never does: it has to learn that azimuths do not matter.
    """
    return isotropic and inputs != STEREOGRAPHIC


def network_inputs(
    wi: Components, wo: Components, rotate_half_vector: bool, inputs: str = PAPER
) -> tuple[Array, ...]:
    """The inputs of a network at a pair of directions to the light and to the viewer.

    "paper" is (h, d) as in the NBRDF paper. "enhanced" keeps the horizontal part of h and of d, and
    stretches what matters: log(sin^2 theta_h + 1e-4) / 9.2 opens up the highlight, log(cos theta +
    .01) / 4.6 of the light and of the view open up grazing angles. Of an isotropic material it
    takes |d_y|, since mirroring changes nothing. "stereographic" is the projections of both
    directions, of light and view as they are, as networks for textures see them (Rainer, Jakob,
    Ghosh and Weyrich 2019, "Neural BTF Compression and Interpolation"). "reciprocal" is like
    "enhanced" but for what a swap of light and view changes.

    `rotate_half_vector` takes h to phi_h = 0, as isotropic networks see it; it is nothing to
    stereographic inputs.
    """
    if inputs == STEREOGRAPHIC:
        return *_projected(wi), *_projected(wo)
    if inputs == RECIPROCAL:
        return _reciprocal(wi, wo, rotate_half_vector)
    h, d = half_difference(wi, wo)
    rotated = isotropic(h) if rotate_half_vector else h
    if inputs == PAPER:
        return (*rotated, *d)
    xp = namespace(*wi, *wo)
    highlight = _highlight(h)
    light, view = (xp.log(xp.maximum(w[2], 0.0) + _HORIZON) * (1.0 / 4.6) for w in (wi, wo))
    if rotate_half_vector:
        return (rotated[0], highlight, light, view, d[0], xp.abs(d[1]))
    return (rotated[0], rotated[1], highlight, light, view, d[0], d[1])


def _highlight(h: Components) -> Array:
    """Logarithm of the angle of h from the normal."""
    return namespace(*h).log(h[0] * h[0] + h[1] * h[1] + _HIGHLIGHT) * (1.0 / 9.2)


def _reciprocal(wi: Components, wo: Components, rotate_half_vector: bool) -> tuple[Array, ...]:
    """Inputs that are the same, to the last bit, where light and view are swapped.

    A swap leaves h, exchanges the cosines, and negates the horizontal part of d, which is that of
    (wi - wo) / 2: floating-point sums commute, and differences are odd. Cosines are taken to be
    :data:`_RIM` at least, lest networks gain energy where hardly any sample is.
    """
    xp = namespace(*wi, *wo)
    h = half_vector(wi, wo)
    half = (0.5 * (wi[0] - wo[0]), 0.5 * (wi[1] - wo[1]), 0.5 * (wi[2] - wo[2]))
    x, y, _ = to_half_frame(half, h)
    light, view = (xp.log(xp.maximum(w[2], _RIM)) * (1.0 / 4.2) for w in (wi, wo))
    lower, upper = xp.minimum(light, view), xp.maximum(light, view)
    if rotate_half_vector:
        return (isotropic(h)[0], _highlight(h), lower, upper, xp.abs(x), xp.abs(y))
    # The angle of (x, y) doubled: the plane with opposite points made one.
    scale = 1.0 / xp.sqrt(xp.maximum(x * x + y * y, _TINY))
    doubled = (x * x - y * y) * scale, 2.0 * x * y * scale
    return (h[0], h[1], _highlight(h), lower, upper, *doubled)


def _projected(w: Components) -> tuple[Array, Array]:
    """Stereographic coordinates in the unit disk; finite below the horizon."""
    return stereographic((w[0], w[1], namespace(*w).maximum(w[2], 0.0)))
