"""A method of the benchmark: ln f_r as a polynomial of how far the half vector is from the normal.

Its entry point, in `pyproject.toml`:

    [project.entry-points."nacre.methods"]
    half-angle = "nacre_lab_example.method:METHOD"
"""

from __future__ import annotations

from functools import reduce

import numpy as np

from nacre.array import Components, namespace
from nacre.geometry import half_vector, join, split, uniform_rusinkiewicz
from nacre.sampling import LobeSampledBrdf
from nacre_lab.benchmark import Method


class HalfAngle(LobeSampledBrdf):
    nbytes = 18 * 4  # what a row counts

    def __init__(self, coefficients):
        super().__init__(name="half angle")
        self.coefficients = coefficients.astype(np.float32)

    def eval_components(self, wi: Components, wo: Components) -> Components:
        xp = namespace(*wi, *wo)
        x = xp.log(1.001 - half_vector(wi, wo)[2])
        columns = self.coefficients.T.tolist()
        return tuple(xp.exp(reduce(lambda y, c: y * x + c, column)) for column in columns)


def fit(brdf):
    wi, wo = map(join, uniform_rusinkiewicz(np.random.default_rng(0).random((4, 20_000))))
    wi, wo = (w[brdf.valid(wi, wo)] for w in (wi, wo))
    x = np.log(1.001 - half_vector(split(wi), split(wo))[2])
    f_r = np.log(np.maximum(brdf.eval(wi, wo), 1e-4))
    return HalfAngle(np.polyfit(x, f_r, 5, w=wi[:, 2] * wo[:, 2]))


METHOD = Method("ln f_r, a polynomial of the half angle", fit, "analytic", {"degree": 5})
