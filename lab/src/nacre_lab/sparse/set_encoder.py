"""A set encoder with a hypernetwork, in the manner of HyperBRDF: our own implementation.

After the description by Gokbudak, Sztrajman, Zhou, Zhong, Mantiuk and Oztireli 2024, "Hypernetworks
for Generalizable BRDF Representation" (arXiv 2311.15783). One network turns each sample, half and
difference vector with the values of three channels, into 40 values; their mean over all samples is
the code, whatever their number and order. Another network turns the code into the weights of a
small network of directions. Values are logarithms relative to the median of the training materials.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Components, Floats, Weights
from nacre.brdf import Brdf
from nacre.latent.directions import isotropic_inputs
from nacre.measured.merl_table import MerlBrdf
from nacre.neural.inputs import PAPER
from nacre.numerics.direction_samples import DirectionSamples
from nacre.numerics.mlp import RELU, AnyLayer, activate, forward, shaped_layers

SIZES = 6, 32, 32, 32, 3
"""Widths of the network of directions."""
CODE, WIDTH = 40, 128
SHIFT = 0.002  # f_r in 1/sr, added before the logarithm
_BRIGHTEST = math.log(1e6)

Shape = tuple[int, int]


def shapes() -> tuple[list[Shape], list[list[Shape]]]:
    """Inputs and outputs of the layers of the encoder, and of one network for each layer of the
    network of directions.
    """
    own = list(itertools.pairwise(SIZES))
    encoder = list(itertools.pairwise((SIZES[0] + SIZES[-1], WIDTH, WIDTH, WIDTH, CODE)))
    counts = [(n + 1) * m for n, m in own]
    return encoder, [list(itertools.pairwise((CODE, WIDTH, WIDTH, count))) for count in counts]


@dataclass(frozen=True, eq=False)
class SetEncoder:
    """The trained networks.

    Parameters
    ----------
    encoder
        Layers from a sample, shape (9,), to values whose mean is the code.
    hyper
        Layers from the code to the weights of each layer of the network of directions.
    reference
        The median of the training materials.
    """

    encoder: Sequence[AnyLayer]
    hyper: Sequence[Sequence[AnyLayer]]
    reference: MerlBrdf

    @classmethod
    def from_weights(cls, weights: npt.ArrayLike, reference: MerlBrdf) -> SetEncoder:
        """From all weights, one layer after the other as :func:`shapes` names them."""
        encoder, hyper = shapes()
        layers = iter(shaped_layers(weights, [*encoder, *itertools.chain(*hyper)]))
        first = [next(layers) for _ in encoder]
        return cls(first, [[next(layers) for _ in each] for each in hyper], reference)

    def encode(self, samples: DirectionSamples) -> Floats:
        """The code of samples, one or more, shape (40,)."""
        if not len(samples):
            raise ValueError("a code needs one sample or more")
        inputs = isotropic_inputs(samples.wi, samples.wo, PAPER)
        values = relative(samples.rgb, self.reference.eval(samples.wi, samples.wo))
        rows = np.concatenate([inputs, values], axis=1).astype(np.float32)
        return np.asarray(embedded(rows, self.encoder).mean(axis=0))

    def decode(self, code: npt.ArrayLike, name: str = "") -> SetEncodedBrdf:
        """The material of a code."""
        return SetEncodedBrdf(self, np.asarray(code, np.float32), name)


class SetEncodedBrdf(Brdf):
    """What a code stands for."""

    isotropy_known = True
    traceable = False

    def __init__(self, encoder: SetEncoder, code: Floats, name: str = "") -> None:
        super().__init__(name=name)
        self.code, self._reference = code, encoder.reference
        self._layers = [(w[0], b[0]) for w, b in generated(code[None], encoder.hyper)]

    @property
    def nbytes(self) -> int:
        """Bytes of the code: all materials share the networks."""
        return int(self.code.nbytes)

    def eval_components(self, wi: Components, wo: Components) -> Components:
        light, view = (np.stack(np.broadcast_arrays(*w), axis=-1) for w in (wi, wo))
        values = forward(isotropic_inputs(light, view, PAPER), self._layers)
        f_r = absolute(values, self._reference.eval(light, view))
        return f_r[:, 0], f_r[:, 1], f_r[:, 2]


def embedded(samples: Any, encoder: Sequence[AnyLayer]) -> Any:
    """What each sample (..., 9) adds to the mean that is the code, shape (..., 40)."""
    return activate(forward(samples, encoder), RELU)


def generated(codes: Any, hyper: Sequence[Sequence[AnyLayer]]) -> list[tuple[Any, Any]]:
    """Weights (m, inputs, outputs) and biases (m, outputs) of the networks of codes (m, 40)."""
    found = []
    for (n, m), layers in zip(itertools.pairwise(SIZES), hyper, strict=True):
        values = forward(codes, layers)
        found.append((values[:, : n * m].reshape(-1, n, m), values[:, n * m :]))
    return found


def relative(f_r: npt.ArrayLike, reference: Weights) -> Weights:
    """ln(1 + (f_r + e) / (r + e)) of f_r in 1/sr, shapes (..., 3)."""
    ratio = (np.maximum(f_r, 0.0) + SHIFT) / (reference + SHIFT)
    return np.log1p(ratio).astype(np.float32)


def absolute(values: Weights, reference: Weights) -> Floats:
    """f_r of relative values, the inverse of :func:`relative`."""
    ratio = np.expm1(np.minimum(values, _BRIGHTEST))
    return np.asarray(np.maximum(ratio * (reference + SHIFT) - SHIFT, 0.0))
