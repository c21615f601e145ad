"""Scans of made-up materials, and how far a reflectance is from one."""

from __future__ import annotations

import numpy as np

from nacre.array import Components
from nacre.brdf import Brdf
from nacre.geometry import half_vector
from nacre.measured import ScatteredBrdf
from tests.measured.support import hemisphere


class Gloss(Brdf):
    """A reddish base with a white highlight; not reciprocal: brighter for light from above."""

    def eval_components(self, wi: Components, wo: Components) -> Components:
        lobe = np.maximum(half_vector(wi, wo)[2], 1e-9) ** 40.0
        return (0.2 + 0.1 * wi[2]) + lobe, 0.1 + lobe, 0.05 + lobe


def scan(truth: Brdf, count: int = 1500, seed: int = 0, **options: object) -> ScatteredBrdf:
    """Samples at directions up to 80 degrees from the normal."""
    random = np.random.default_rng(seed)
    wi, wo = hemisphere(random, 3 * count), hemisphere(random, 3 * count)
    high = (wi[:, 2] > 0.17) & (wo[:, 2] > 0.17)
    wi, wo = wi[high][:count], wo[high][:count]
    rgb = truth.eval(wi.astype(np.float64), wo)
    return ScatteredBrdf(wi, wo, rgb, "scan", isotropic=truth.isotropic, **options)


def median_error(truth: Brdf, other: Brdf) -> float:
    random = np.random.default_rng(9)
    wi, wo = hemisphere(random, 5000), hemisphere(random, 5000)
    high = (wi[:, 2] > 0.2) & (wo[:, 2] > 0.2)
    expected, got = (b.eval(wi[high], wo[high]) for b in (truth, other))
    return float(np.median(np.abs(got - expected) / expected))


def awkward(name: str) -> ScatteredBrdf:
    """Samples as they should not be: few, in one plane, over and over, of every magnitude."""
    random = np.random.default_rng(13)
    count = int(name) if name.isdigit() else 60
    wi, wo = (hemisphere(random, count).astype(np.float64) for _ in range(2))
    wi[:, 2], wo[:, 2] = (np.maximum(w[:, 2], 0.05) for w in (wi, wo))
    rgb = 0.1 + random.random((count, 3))
    if name == "one direction":
        wi[:], wo[:] = wi[0], wo[0]
    elif name == "plane of incidence":
        wi[:, 1] = wo[:, 1] = 0.0
    elif name == "every magnitude":
        rgb = 10.0 ** random.uniform(-9.0, 6.0, (count, 3))
    elif name == "duplicates":
        wi[1::2], wo[1::2] = wi[::2], wo[::2]
    elif name == "black":
        rgb[:] = 0.0
    return ScatteredBrdf(wi, wo, rgb, name)


AWKWARD = (
    *("1", "3", "10", "50"),
    *("one direction", "plane of incidence", "every magnitude", "duplicates", "black"),
)


def everywhere(count: int = 20_000) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of directions, half of them within a tenth of a degree of the horizon."""
    random = np.random.default_rng(4)
    wi, wo = (hemisphere(random, count).astype(np.float64) for _ in range(2))
    wi[::2, 2] *= 1e-3
    wo[::4, 2] *= 1e-3
    wo[1::8] = wi[1::8] * [-1.0, -1.0, 1.0]
    return tuple(w / np.linalg.norm(w, axis=1, keepdims=True) for w in (wi, wo))
