"""The code that is most likely, given reflectance at any directions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nacre.array import Floats
from nacre.btf.basis.functions import FunctionValues
from nacre.btf.basis.skip_network import SkipNetwork
from nacre.channels import split_colors

_FIRST_DAMPING = 1e-2
_LEAST_DAMPING, _MOST_DAMPING = 1e-6, 1e6


@dataclass(frozen=True, eq=False)
class Prior:
    """What texels are like, from those of the training.

    Parameters
    ----------
    deviations
        Of coefficients from zero: those of grey values, then of one value of the pairs.
    noise
        Variance of reflectance factors about the sums of functions: what sums cannot express, and
        noise of the measurement.
    code_mean, code_precision
        Of codes, shapes (values,) and (values, values).
    """

    deviations: Floats
    noise: float
    code_mean: Floats
    code_precision: Floats


class Observation:
    """The normal equations of coefficients for a set of directions.

    Parameters
    ----------
    functions
        Their values at the directions.
    """

    def __init__(self, functions: FunctionValues) -> None:
        self.functions = functions
        blocks = [np.asarray(f, np.float64) for f in (functions.grey, functions.chroma)]
        self.grams = [block.T @ block for block in blocks]
        chroma = self.grams[1]
        size = [len(gram) for gram in self.grams]
        whole = np.zeros((size[0] + 2 * size[1],) * 2)
        whole[: size[0], : size[0]] = self.grams[0]
        for start in (size[0], size[0] + size[1]):
            whole[start : start + size[1], start : start + size[1]] = chroma
        self.gram = whole.astype(np.float32)

    def moments(self, texels: Floats) -> Floats:
        """Products of the functions with reflectance (b, n, 3) less the mean, shape (b, K)."""
        grey, chroma = split_colors(texels)
        grey -= self.functions.mean
        parts = [grey @ self.functions.grey, *(c @ self.functions.chroma for c in chroma)]
        return np.concatenate(parts, axis=1)

    def ridge(self, moments: Floats, prior: Prior) -> Floats:
        """Coefficients of least squares with the prior's variances, shape (b, K)."""
        penalty = prior.noise / np.maximum(prior.deviations.astype(np.float64), 1e-9) ** 2
        sizes = [len(self.grams[0]), len(self.grams[1])]
        grey = np.linalg.inv(self.grams[0] + np.diag(penalty[: sizes[0]]))
        chroma = np.linalg.inv(self.grams[1] + np.diag(penalty[sizes[0] :]))
        parts = np.split(moments, [sizes[0], sum(sizes)], axis=1)
        inverses = (grey, chroma, chroma)
        found = [p @ i.astype(np.float32) for p, i in zip(parts, inverses, strict=True)]
        return np.concatenate(found, axis=1)

    def refine(
        self, codes: Floats, moments: Floats, decode: SkipNetwork, prior: Prior, steps: int
    ) -> Floats:
        """Codes (b, values) nearer to the most likely ones, by damped Gauss-Newton steps.

        The likelihood is of the reflectance itself at the directions that are known; all of it is
        in the moments. The prior is a normal distribution of codes.
        """
        damping = np.full(len(codes), _FIRST_DAMPING, np.float32)
        best = np.full(len(codes), np.inf, np.float32)
        trial, value, slopes = codes, *decode.jacobian(codes)
        codes = codes.copy()
        state: tuple[Floats, Floats] | None = None
        for _ in range(steps + 1):
            away = trial - prior.code_mean
            pulled = value @ self.gram
            error = ((pulled - 2.0 * moments) * value).sum(1) / prior.noise
            error += ((away @ prior.code_precision) * away).sum(1)
            better = error < best
            best = np.where(better, error, best)
            codes[better] = trial[better]
            damping = np.clip(
                np.where(better, damping * 0.3, damping * 5.0), _LEAST_DAMPING, _MOST_DAMPING
            ).astype(np.float32)
            gradient = (slopes @ (moments - pulled)[..., None])[..., 0] / prior.noise
            gradient -= away @ prior.code_precision
            curvature = (slopes @ self.gram) @ slopes.swapaxes(1, 2) / prior.noise
            curvature += prior.code_precision
            if state is not None:
                gradient = np.where(better[:, None], gradient, state[0])
                curvature = np.where(better[:, None, None], curvature, state[1])
            state = gradient, curvature
            diagonal = np.einsum("bii->bi", curvature)
            damped = curvature + np.einsum("bi,ij->bij", diagonal * damping[:, None], _eye(codes))
            trial = codes + np.linalg.solve(damped, gradient[..., None])[..., 0]
            value, slopes = decode.jacobian(trial)
        return codes


def _eye(codes: Floats) -> Floats:
    return np.eye(codes.shape[1], dtype=np.float32)
