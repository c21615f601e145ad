"""Samples of a reflectance at random directions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nacre.array import Array, Components, Floats
from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.geometry import cosine_hemisphere, join, split, uniform_hemisphere, uniform_rusinkiewicz
from nacre.numerics.direction_samples import DirectionSamples
from nacre.runtime.parallel import thread_map
from nacre.sampling.fit import fit_blinn_phong

Directions = Callable[[Array], tuple[Components, Components]]
"""From numbers in [0, 1), shape (6, n), to pairs (wi, wo); some may lie below the horizon."""


def _rusinkiewicz(brdf: Brdf) -> Directions:
    return lambda u: uniform_rusinkiewicz(u[:4])


def _hemisphere(brdf: Brdf) -> Directions:
    return lambda u: (uniform_hemisphere(u[0], u[1]), uniform_hemisphere(u[2], u[3]))


def _seen(brdf: Brdf) -> Directions:
    """Views as the pixels of a picture of a sphere have them, under an even sky or a highlight."""
    sampled = brdf if brdf.sampler.adapted else brdf.replaced(sampler=fit_blinn_phong(brdf))

    def directions(u: Array) -> tuple[Components, Components]:
        wo = cosine_hemisphere(u[0], u[1])
        drawn, density = sampled.sample(join(wo), u[2:5].T)
        reflected = split(drawn)
        even = uniform_hemisphere(u[2], u[3])
        sky = (u[5] < 0.5) | (density <= 0.0)
        wi = tuple(np.where(sky, a, b) for a, b in zip(even, reflected, strict=True))
        return wi, wo

    return directions


def _mixed(brdf: Brdf) -> Directions:
    parts = _rusinkiewicz(brdf), _seen(brdf)

    def directions(u: Array) -> tuple[Components, Components]:
        wi, wo = np.empty((2, 3, u.shape[1]), u.dtype)
        for start, part in enumerate(parts):
            pair = part(u[:, start::2])
            wi[:, start::2], wo[:, start::2] = (np.broadcast_arrays(*w) for w in pair)
        return tuple(wi), tuple(wo)

    return directions


DISTRIBUTIONS: dict[str, Callable[[Brdf], Directions]] = {
    "rusinkiewicz": _rusinkiewicz,
    "hemisphere": _hemisphere,
    "mixed": _mixed,
}
"""How directions are distributed: uniform in the Rusinkiewicz angles, which is dense about the
mirror direction (the "adaptive sampling" of the NBRDF paper, section 4.1); or both directions
uniform over the solid angle of the hemisphere, each on its own (its "uniform sampling"); or half of
the samples as the first, and half with views as dense as cos(theta), as pictures of a sphere show
them, where the light comes from anywhere in the sky or from the reflectance's sampler (fitted to it
where it has none)."""

_CHUNK = 1 << 15
_NORMAL = np.array([[0.0, 0.0, 1.0]], np.float32)
_HOPELESS = 64  # chunks without enough valid samples after which drawing gives up


def draw_samples(
    brdf: Brdf,
    count: int,
    seed: int,
    progress: Callable[[int, int], None] | None = None,
    distribution: str = "rusinkiewicz",
    values: Callable[[Floats, Floats], Floats] | None = None,
) -> DirectionSamples:
    """Samples at random directions in float32, by default uniform in the Rusinkiewicz angles.

    Then theta_h and theta_d lie in [0, pi/2), phi_d in [0, 2 pi); phi_h in [0, 2 pi) for an
    anisotropic reflectance, else 0 (NBRDF paper, section 3.1). Pairs with a direction below the
    horizon, and samples that are not valid or not finite, are dropped and replaced, so that `count`
    remain. The same seed gives the same samples; `progress` is called with the number of samples
    drawn and `count`; `distribution` is one of :data:`DISTRIBUTIONS`; `values`, which gives arrays
    of shape (n, k), is evaluated in place of the colors. Raises NacreError if hardly any sample is
    valid.
    """
    directions = DISTRIBUTIONS[distribution](brdf)
    values = values or brdf.eval
    width = values(_NORMAL, _NORMAL).shape[-1]
    wi, wo, rgb = (np.empty((count, k), np.float32) for k in (3, 3, width))
    filled = chunk = 0
    while filled < count:
        if chunk > _HOPELESS and filled < chunk * _CHUNK // 1000:
            raise NacreError(f"{brdf.name or 'reflectance'}: hardly any sample is valid")
        wave = range(chunk, chunk + max(1, (count - filled) // _CHUNK))
        for part in thread_map(lambda k: _draw_chunk(brdf, values, directions, (seed, k)), wave):
            kept = min(len(part), count - filled)
            for whole, piece in ((wi, part.wi), (wo, part.wo), (rgb, part.rgb)):
                whole[filled : filled + kept] = piece[:kept]
            filled += kept
            if progress:
                progress(filled, count)
        chunk = wave.stop
    return DirectionSamples(wi, wo, rgb)


def _draw_chunk(
    brdf: Brdf,
    values: Callable[[Floats, Floats], Floats],
    directions: Directions,
    seed: tuple[int, int],
) -> DirectionSamples:
    random = np.random.default_rng(seed)
    u = random.random((6, _CHUNK), dtype=np.float32)
    if brdf.isotropic:
        u[1] = 0.0
    wi, wo = directions(u)
    visible = (wi[2] > 0) & (wo[2] > 0)
    wi, wo = (join(w)[visible] for w in (wi, wo))
    known = brdf.valid(wi, wo)
    wi, wo = wi[known], wo[known]
    rgb = values(wi, wo)
    finite = np.isfinite(rgb).all(axis=1)
    return DirectionSamples(wi[finite], wo[finite], rgb[finite])
