"""Samples between and beyond those of a scan, from the interpolation of the scan.

Without them a network does as it likes where nothing was measured, above all toward the horizon,
where a highlight is still rising at the last measured angle. Interpolation is kept within the range
of the nearest samples, so its samples say: go on as the last ones were, and no higher.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from nacre.array import Floats
from nacre.geometry import from_spherical, join, uniform_rusinkiewicz
from nacre.numerics.direction_samples import DirectionSamples, Scattered
from nacre.runtime.parallel import thread_map

_FRACTIONS = 0.2, 0.3, 0.2
"""Fractions of directions near the scan's own, near a mirror direction, and over all polar angles;
the rest is uniform in the Rusinkiewicz angles."""
_DEVIATION = 0.05  # standard deviation of directions near the scan's own, about an axis, in radians
_MIRROR_DEVIATION = 1e-3, 0.3  # range of it near mirror directions: highlights are of every width
_CHUNK = 1 << 14


def augmentation(
    scan: Scattered,
    count: int,
    seed: int,
    progress: Callable[[int, int], None] | None = None,
    values: Callable[[Floats, Floats], Floats] | None = None,
) -> DirectionSamples:
    """Interpolated samples that cover the whole hemisphere, up to the horizon.

    A fifth lies near samples of the scan, three tenths near mirror directions at any angle of
    incidence, a fifth is uniform in the polar angles of both directions, the rest uniform in the
    Rusinkiewicz angles. The same seed gives the same ones; `progress` is called with the number of
    samples drawn and `count`. `values` is evaluated in place of the scan's colors, and gives arrays
    of shape (n, k).
    """
    report = progress or (lambda done, total: None)
    random = np.random.default_rng((seed, 5))
    wi, wo = np.zeros((2, 0, 3))
    while len(wi) < count:
        more = np.array(_directions(scan, count, random))
        above = more[..., 2].min(axis=0) > 0.0
        wi, wo = np.concatenate([[wi, wo], more[:, above]], axis=1)[:, :count]
    evaluated = values or scan.eval
    rgb = np.empty((count, np.shape(evaluated(wi[:1], wo[:1]))[-1]))

    def evaluate(start: int) -> int:
        part = slice(start, start + _CHUNK)
        rgb[part] = evaluated(wi[part], wo[part])
        return min(start + _CHUNK, count)

    for done in thread_map(evaluate, range(0, count, _CHUNK)):
        report(done, count)
    return DirectionSamples(wi, wo, rgb)


def _directions(scan: Scattered, count: int, random: np.random.Generator) -> tuple[Floats, Floats]:
    """Pairs of every kind, mixed; some lie below the horizon."""
    own, mirror, polar, rest = random.multinomial(count, [*_FRACTIONS, 1.0 - sum(_FRACTIONS)])

    def light(n: int) -> Floats:
        theta, phi = random.random((2, n)) * [[0.5 * math.pi], [2.0 * math.pi]]
        return join(from_spherical(theta, phi))

    near = scan.samples[random.integers(0, len(scan.samples), own)]
    towards = light(mirror)
    reflected = towards * [-1.0, -1.0, 1.0]
    narrow, wide = np.log(_MIRROR_DEVIATION)
    deviation = np.exp(random.uniform(narrow, wide, (mirror, 1)))
    pairs = [
        (_around(near.wi, _DEVIATION, random), _around(near.wo, _DEVIATION, random)),
        (towards, _around(reflected, deviation, random)),
        (light(polar), light(polar)),
        tuple(map(join, uniform_rusinkiewicz(random.random((4, rest))))),
    ]
    order = random.permutation(count)
    wi, wo = (np.concatenate(w)[order] for w in zip(*pairs, strict=True))
    return wi, wo


def _around(w: Floats, deviation: Floats | float, random: np.random.Generator) -> Floats:
    moved = w + deviation * random.normal(size=w.shape)
    return np.asarray(moved / np.linalg.norm(moved, axis=1, keepdims=True), np.float64)
