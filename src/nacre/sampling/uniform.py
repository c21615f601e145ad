"""Samples of a reflectance at random directions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nacre.array import Array, Components
from nacre.brdf import Brdf, DirectionSamples
from nacre.files import NacreError
from nacre.geometry import join, uniform_hemisphere, uniform_rusinkiewicz
from nacre.parallel import thread_map


def _hemisphere(u: Array) -> tuple[Components, Components]:
    return uniform_hemisphere(u[0], u[1]), uniform_hemisphere(u[2], u[3])


def _mixed(u: Array) -> tuple[Components, Components]:
    """Half in the Rusinkiewicz angles, theta_h as dense as MERL's nodes; half by solid angle."""
    near = u[0] < 0.5
    first = 2.0 * u[0] - (1.0 - near.astype(u.dtype))
    pairs = zip(
        uniform_rusinkiewicz(np.stack([first * first, *u[1:]])),
        _hemisphere(np.stack([first, *u[1:]])),
        strict=True,
    )
    wi, wo = (
        tuple(np.where(near, a, b) for a, b in zip(highlight, even, strict=True))
        for highlight, even in pairs
    )
    return wi, wo


DISTRIBUTIONS: dict[str, Callable[[Array], tuple[Components, Components]]] = {
    "rusinkiewicz": uniform_rusinkiewicz,
    "hemisphere": _hemisphere,
    "mixed": _mixed,
}
"""How directions are distributed: uniform in the Rusinkiewicz angles, which is dense about the
mirror direction (the "adaptive sampling" of the NBRDF paper, section 4.1); or both directions
uniform over the solid angle of the hemisphere, each on its own (its "uniform sampling"); or half
of the samples like the latter and half in the Rusinkiewicz angles, denser still near the mirror
direction (density of theta_h as its inverse root)."""

_CHUNK = 1 << 15
_HOPELESS = 64
"""Chunks without enough valid samples after which drawing gives up."""


def draw_samples(
    brdf: Brdf,
    count: int,
    seed: int,
    progress: Callable[[int, int], None] | None = None,
    distribution: str = "rusinkiewicz",
) -> DirectionSamples:
    """Samples at random directions, by default uniform in the Rusinkiewicz angles.

    Then theta_h and theta_d lie in [0, pi/2), phi_d in [0, 2 pi); phi_h in [0, 2 pi) for an
    anisotropic reflectance, else 0 (NBRDF paper, section 3.1). Pairs with a direction below the
    horizon, and samples that are not valid or not finite, are dropped and replaced, so that `count`
    remain.

    Parameters
    ----------
    brdf
        Reflectance to sample.
    count
        Number of samples.
    seed
        The same seed gives the same samples.
    progress
        Called with the number of samples drawn and `count`.
    distribution
        One of :data:`DISTRIBUTIONS`.

    Returns
    -------
    DirectionSamples
        Of float32.

    Raises
    ------
    NacreError
        If hardly any sample is valid.
    """
    wi, wo, rgb = (np.empty((count, 3), np.float32) for _ in range(3))
    filled = chunk = 0
    while filled < count:
        if chunk > _HOPELESS and filled < chunk * _CHUNK // 1000:
            raise NacreError(f"{brdf.name or 'reflectance'}: hardly any sample is valid")
        wave = range(chunk, chunk + max(1, (count - filled) // _CHUNK))
        for part in thread_map(lambda k: _draw_chunk(brdf, (seed, k), distribution), wave):
            kept = min(len(part), count - filled)
            for whole, piece in ((wi, part.wi), (wo, part.wo), (rgb, part.rgb)):
                whole[filled : filled + kept] = piece[:kept]
            filled += kept
            if progress:
                progress(filled, count)
        chunk = wave.stop
    return DirectionSamples(wi, wo, rgb)


def _draw_chunk(brdf: Brdf, seed: tuple[int, int], distribution: str) -> DirectionSamples:
    random = np.random.default_rng(seed)
    u = random.random((4, _CHUNK), dtype=np.float32)
    if brdf.isotropic:
        u[1] = 0.0
    wi, wo = DISTRIBUTIONS[distribution](u)
    visible = (wi[2] > 0) & (wo[2] > 0)
    wi, wo = (join(w)[visible] for w in (wi, wo))
    known = brdf.valid(wi, wo)
    wi, wo = wi[known], wo[known]
    rgb = brdf.eval(wi, wo)
    finite = np.isfinite(rgb).all(axis=1)
    return DirectionSamples(wi[finite], wo[finite], rgb[finite])
