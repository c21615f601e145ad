"""What a network sees of a pair of directions."""

from __future__ import annotations

from nacre.array import Array, Components, namespace
from nacre.errors import NacreError
from nacre.geometry import (
    carried_to_pole,
    half_difference,
    half_vector,
    isotropic,
    rotate,
    stereographic,
    to_half_frame,
)

PAPER, ENHANCED, STEREOGRAPHIC = "paper", "enhanced", "stereographic"
SPINNING = "spinning"
"""Enhanced inputs of anisotropic networks as they once were; files with them still load."""
RECIPROCAL = "reciprocal"
INPUTS = (PAPER, ENHANCED, STEREOGRAPHIC, SPINNING, RECIPROCAL)
"""Names of the parametrizations of a network's inputs."""

LARGEST_INPUT = 1.01  # bound of the magnitude of every input

_HIGHLIGHT = 1e-4  # added to sin^2 theta_h before its logarithm: below .6 degrees all look alike
_AXIS = 1e-3  # the same of the square of each horizontal part of h
_HORIZON = 0.01  # added to cosines before their logarithm
_RIM = 0.015  # cosine below which all directions to the horizon look alike to physical networks
_TINY = 1e-30


def input_count(inputs: str, rotate_half_vector: bool) -> int:
    """How many numbers :func:`network_inputs` gives; NacreError where the name is unknown."""
    if inputs not in INPUTS:
        raise NacreError(f"unknown inputs {inputs!r}, expected one of {', '.join(INPUTS)}")
    if inputs == STEREOGRAPHIC:
        return 4
    if inputs == SPINNING or (inputs == RECIPROCAL and not rotate_half_vector):
        return 7
    return 6 if inputs == PAPER or rotate_half_vector else 8


def rotates_half_vector(inputs: str, isotropic: bool) -> bool:
    """Whether a network rotates h to phi_h = 0 when it is fitted to an isotropic material.

    With stereographic or spinning inputs it never does: it has to learn that azimuths do not
    matter.
    """
    return isotropic and inputs not in (STEREOGRAPHIC, SPINNING)


def network_inputs(
    wi: Components,
    wo: Components,
    rotate_half_vector: bool,
    inputs: str = PAPER,
    angle: Array | float = 0.0,
) -> tuple[Array, ...]:
    """The inputs of a network at a pair of directions to the light and to the viewer.

    "paper" is (h, d) as in the NBRDF paper. "enhanced" keeps the horizontal part of h and of d, and
    stretches what matters: log(sin^2 theta_h + 1e-4) / 9.2 opens up the highlight, log(cos theta +
    .01) / 4.6 of the light and of the view open up grazing angles. For isotropic materials it takes
    |d_y|, since mirroring changes nothing. For anisotropic ones it opens up the highlight along
    each axis, by log(h_x^2 + .001) / 6.91 and the same of h_y, and takes d from
    :func:`nacre.geometry.carried_to_pole`, which does not spin where h is near the normal.
    "spinning" is its predecessor: one logarithm, and Rusinkiewicz's d. "stereographic" are the
    projections of both directions, as networks for textures see them (Rainer, Jakob, Ghosh and
    Weyrich 2019, "Neural BTF Compression and Interpolation"). "reciprocal" is like "enhanced",
    without what a swap of light and view changes.

    `rotate_half_vector` takes h to phi_h = 0, as isotropic networks see it; stereographic and
    spinning inputs ignore it. `angle` is the azimuth, in radians from +x toward +y, of the axis
    that takes the place of x (see :func:`has_axes`).
    """
    if inputs == STEREOGRAPHIC:
        return *_projected(wi), *_projected(wo)
    if inputs == RECIPROCAL:
        return _reciprocal(wi, wo, rotate_half_vector)
    if has_axes(inputs, rotate_half_vector):
        return _along_axes(wi, wo, angle)
    h, d = half_difference(wi, wo)
    if inputs == PAPER:
        return (*(isotropic(h) if rotate_half_vector else h), *d)
    xp = namespace(*wi, *wo)
    highlight = _highlight(h)
    if inputs == SPINNING:
        return (h[0], h[1], highlight, _grazing(wi), _grazing(wo), d[0], d[1])
    return (isotropic(h)[0], highlight, _grazing(wi), _grazing(wo), d[0], xp.abs(d[1]))


def has_axes(inputs: str, rotate_half_vector: bool) -> bool:
    """Whether inputs depend on where the axes of a material lie."""
    return inputs == ENHANCED and not rotate_half_vector


def _along_axes(wi: Components, wo: Components, angle: Array | float) -> tuple[Array, ...]:
    """The enhanced inputs of an anisotropic material."""
    xp = namespace(*wi, *wo)
    if not isinstance(angle, float) or angle:
        wi, wo = rotate(wi, -angle), rotate(wo, -angle)
    h = half_vector(wi, wo)
    d = carried_to_pole(wi, h)
    along, across = (xp.log(x * x + _AXIS) * (1.0 / 6.91) for x in h[:2])
    return (h[0], h[1], along, across, _grazing(wi), _grazing(wo), d[0], d[1])


def _grazing(w: Components) -> Array:
    """What opens up angles near the horizon."""
    return namespace(*w).log(namespace(*w).maximum(w[2], 0.0) + _HORIZON) * (1.0 / 4.6)


def _highlight(h: Components) -> Array:
    """Logarithm of the angle of h from the normal."""
    return namespace(*h).log(h[0] * h[0] + h[1] * h[1] + _HIGHLIGHT) * (1.0 / 9.2)


def _reciprocal(wi: Components, wo: Components, rotate_half_vector: bool) -> tuple[Array, ...]:
    """Inputs that are the same, to the last bit, where light and view are swapped.

    A swap leaves h, exchanges the cosines, and negates the horizontal part of d, which is that of
    (wi - wo) / 2: floating-point sums commute, and differences are odd. Cosines are taken to be
    :data:`_RIM` at least, lest networks gain energy where there is hardly any sample.
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
