"""Directions, frames and the parametrizations of pairs of directions.

Conventions: the local frame has the surface normal along +z. `wi` points to the light, `wo` to the
viewer, both away from the surface and of unit length. Angles are radians. Every function works on
components (see :mod:`nacre.array`) of any array library unless it says otherwise; :func:`split`
and :func:`join` go from and to arrays of shape (..., 3).

The half vector h is the normalized sum of the two directions; the difference vector d is `wi`
expressed in the frame whose z axis is h (Rusinkiewicz 1998, "A New Change of Variables for
Efficient BRDF Representation").
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import numpy.typing as npt

from nacre.array import Array, Components, Vectors, namespace

_TINY = 1e-30
_OPPOSITE = 1e-6  # of 1 + h_z
_POLE = 2.0**-49  # sine below which a direction is the pole: its square is still a normal float32


def split(vectors: npt.ArrayLike) -> Components:
    """Components of vectors of shape (..., 3): of a NumPy array, a tensor, or a JAX array."""
    array: Array = vectors if namespace(vectors).differentiable else np.asarray(vectors)
    if array.shape[-1:] != (3,):
        raise ValueError(f"expected an array of shape (..., 3), got {tuple(array.shape)}")
    return array[..., 0], array[..., 1], array[..., 2]


def broadcast_shape(**named: Array) -> tuple[int, ...]:
    """The shape (..., 3) that arrays of any library broadcast to.

    Raises ValueError, naming what has no such shape, or shapes that do not broadcast.
    """
    # In plain words, which torch.compile follows.
    shapes = {name: tuple(array.shape) for name, array in named.items()}
    for name, shape in shapes.items():
        if shape[-1:] != (3,):
            raise ValueError(f"expected {name} of shape (..., 3), got {shape}")
    found: list[int] = []
    for sizes in itertools.zip_longest(*(shape[::-1] for shape in shapes.values()), fillvalue=1):
        size = next((size for size in sizes if size != 1), 1)
        if any(other not in (1, size) for other in sizes):
            text = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
            raise ValueError(f"shapes do not broadcast: {text}")
        found.insert(0, size)
    return tuple(found)


def join(components: Components) -> Vectors:
    """Array of shape (..., 3) from three components, of their library."""
    joined: Vectors = namespace(*components).join(components)
    return joined


def dot(a: Components, b: Components) -> Array:
    """Inner product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def normalize(v: Components) -> Components:
    """`v` scaled to unit length; the zero vector stays zero."""
    xp = namespace(*v)
    scale = 1.0 / xp.sqrt(xp.maximum(dot(v, v), _TINY))
    return v[0] * scale, v[1] * scale, v[2] * scale


def reflect(w: Components, axis: Components) -> Components:
    """`w` mirrored about the unit vector `axis`."""
    k = 2.0 * dot(w, axis)
    return k * axis[0] - w[0], k * axis[1] - w[1], k * axis[2] - w[2]


def rotate(w: Components, angle: Array) -> Components:
    """`w` rotated about z by an angle, in radians, from x toward y."""
    xp = namespace(angle)
    cos, sin = xp.cos(angle), xp.sin(angle)
    if isinstance(angle, float):
        cos, sin = float(cos), float(sin)  # NumPy's scalars would make float32 arrays double
    return cos * w[0] - sin * w[1], sin * w[0] + cos * w[1], w[2]


def half_vector(wi: Components, wo: Components) -> Components:
    """Unit half vector; zero where `wi` = -`wo`."""
    return normalize((wi[0] + wo[0], wi[1] + wo[1], wi[2] + wo[2]))


def polar_sine(w: Components) -> Array:
    """Sine of the polar angle of a unit vector, at least 2^-49."""
    # Not 0 even at the pole, where the square root has no derivative.
    xp = namespace(*w)
    return xp.sqrt(xp.maximum(w[0] * w[0] + w[1] * w[1], _POLE * _POLE))


def azimuth(w: Components) -> tuple[Array, Array, Array]:
    """Cosine and sine of a unit vector's azimuth (0 at the pole), and the polar sine."""
    xp = namespace(*w)
    sin_theta = polar_sine(w)
    pole = sin_theta <= 2.0 * _POLE  # roots of graphics cards are not exact
    scale = xp.where(pole, 0.0, 1.0 / sin_theta)
    cos_phi = xp.where(pole, 1.0, w[0] * scale)
    return cos_phi, w[1] * scale, sin_theta


def half_difference(wi: Components, wo: Components) -> tuple[Components, Components]:
    """Rusinkiewicz vectors (h, d) of a pair of directions, without trigonometry.

    d is `wi` rotated by -phi_h about z, then by -theta_h about y. At the pole of h, where phi_h is
    free, phi_h = 0.
    """
    h = half_vector(wi, wo)
    return h, to_half_frame(wi, h)


def to_half_frame(w: Components, h: Components) -> Components:
    """`w` rotated by -phi_h about z, then by -theta_h about y, which takes the unit vector h to the
    pole. Exactly odd in `w`: rounding is the same for -w.
    """
    cos_phi, sin_phi, sin_theta = azimuth(h)
    x = cos_phi * w[0] + sin_phi * w[1]
    y = cos_phi * w[1] - sin_phi * w[0]
    return h[2] * x - sin_theta * w[2], y, sin_theta * x + h[2] * w[2]


def carried_to_pole(w: Components, h: Components) -> Components:
    """`w` under the smallest rotation that takes the unit vector h to the pole.

    It is finite, but no rotation, where h is within 0.1 degrees of the opposite pole.

    For the light this is Rusinkiewicz's d turned by phi_h about z: unlike d, it is smooth where h
    is the normal, so that what depends on azimuths need not be learned anew for each.
    """
    divisor = namespace(*h).maximum(1.0 + h[2], _OPPOSITE)
    along = w[2] + (h[0] * w[0] + h[1] * w[1]) / divisor
    return w[0] - h[0] * along, w[1] - h[1] * along, dot(w, h)


def from_half_difference(h: Components, d: Components) -> tuple[Components, Components]:
    """Directions (wi, wo) from Rusinkiewicz vectors; inverse of :func:`half_difference`."""
    cos_phi, sin_phi, sin_theta = azimuth(h)

    def to_frame(v: Components) -> Components:
        x, z = h[2] * v[0] + sin_theta * v[2], h[2] * v[2] - sin_theta * v[0]
        return cos_phi * x - sin_phi * v[1], sin_phi * x + cos_phi * v[1], z

    return to_frame(d), to_frame((-d[0], -d[1], d[2]))


def isotropic(h: Components) -> Components:
    """Half vector rotated to phi_h = 0: (sin theta_h, 0, cos theta_h); the 0 is a plain number."""
    return polar_sine(h), 0.0, h[2]


def from_spherical(theta: Array, phi: Array) -> Components:
    """Unit vector with a polar angle from z and an azimuth from x."""
    xp = namespace(theta, phi)
    sin_theta = xp.sin(theta)
    return sin_theta * xp.cos(phi), sin_theta * xp.sin(phi), xp.cos(theta)


def to_spherical(w: Components) -> tuple[Array, Array]:
    """Polar angle in [0, pi] and azimuth in (-pi, pi] of a vector."""
    xp = namespace(*w)
    return xp.arctan2(xp.sqrt(w[0] * w[0] + w[1] * w[1]), w[2]), xp.arctan2(w[1], w[0])


def rusinkiewicz_angles(wi: Components, wo: Components) -> tuple[Array, Array, Array, Array]:
    """Angles (theta_h, phi_h, theta_d, phi_d) of a pair of directions."""
    h, d = half_difference(wi, wo)
    return (*to_spherical(h), *to_spherical(d))


def from_rusinkiewicz_angles(
    theta_h: Array, phi_h: Array, theta_d: Array, phi_d: Array
) -> tuple[Components, Components]:
    """Directions (wi, wo) from Rusinkiewicz angles; either may lie below the horizon."""
    return from_half_difference(from_spherical(theta_h, phi_h), from_spherical(theta_d, phi_d))


def uniform_rusinkiewicz(u: Array) -> tuple[Components, Components]:
    """Directions (wi, wo) uniform in the Rusinkiewicz angles (NBRDF paper, section 3.1).

    Numbers `u` in [0, 1), shape (4, ...), become theta_h in [0, pi/2), phi_h in [0, 2 pi), theta_d
    in [0, pi/2) and phi_d in [0, 2 pi). Either direction may lie below the horizon.
    """
    quarter, whole = 0.5 * math.pi, 2.0 * math.pi
    return from_rusinkiewicz_angles(u[0] * quarter, u[1] * whole, u[2] * quarter, u[3] * whole)


def stereographic(w: Components) -> tuple[Array, Array]:
    """Projection from the south pole onto the equatorial disk: (x, y) / (1 + z)."""
    scale = 1.0 / (1.0 + w[2])
    return w[0] * scale, w[1] * scale


def from_stereographic(x: Array, y: Array) -> Components:
    """Unit vector with stereographic coordinates; inverse of :func:`stereographic`."""
    r2 = x * x + y * y
    scale = 1.0 / (1.0 + r2)
    return 2.0 * x * scale, 2.0 * y * scale, (1.0 - r2) * scale


def uniform_hemisphere(u: Array, v: Array) -> Components:
    """Direction with density 1 / (2 pi) from two numbers in [0, 1)."""
    xp = namespace(u, v)
    z, phi = 1.0 - u, 2.0 * math.pi * v
    radius = xp.sqrt(xp.maximum(1.0 - z * z, 0.0))
    return radius * xp.cos(phi), radius * xp.sin(phi), z


def cosine_hemisphere(u: Array, v: Array) -> Components:
    """Direction with density cos(theta) / pi from two numbers in [0, 1)."""
    xp = namespace(u, v)
    radius, phi = xp.sqrt(u), 2.0 * math.pi * v
    return radius * xp.cos(phi), radius * xp.sin(phi), xp.sqrt(xp.maximum(1.0 - u, 0.0))
