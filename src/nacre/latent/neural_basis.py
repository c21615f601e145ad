"""Basis functions of directions that one network gives, for materials as sums of them.

The network sees the enhanced inputs of a pair of directions (:mod:`nacre.neural.inputs`); its
outputs take the place of the principal components of :mod:`nacre.latent.pca`. They need no grid,
take less than a hundredth of the memory, and are trained on what pictures show. ln f_r of a channel
is their sum, in which the code weighs them, so a material is a plain network of the shared hidden
layers and an output layer of its own.

Colors go by channel as there. A gray value weighs one function in all channels alike; a pair of
values stands for three weights of one function that sum to 0. So a permutation of the channels of a
material is one of its code, and no permuted material has to be trained on.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Components, Floats, Weights, namespace
from nacre.brdf import Brdf, Sampler
from nacre.latent.codes import checked_code, code_facts
from nacre.latent.directions import isotropic_inputs
from nacre.latent.lobe_predictor import LobePredictor
from nacre.neural.inputs import ENHANCED, network_inputs
from nacre.neural.nbrdf import OUTPUTS, check_weights
from nacre.numerics.channels import CHROMA, CHROMA_PERMUTATIONS
from nacre.numerics.mlp import Layer
from nacre.sampling import fit_lobes
from nacre.sampling.parametrizations import BEST_FAMILY

Double = npt.NDArray[np.float64]

BRIGHTEST = math.log(1e6)
"""Bound of ln f_r: whatever a code holds, what it stands for is finite."""


@dataclass(frozen=True, eq=False)
class NeuralBasis:
    """A network whose outputs are functions that materials are sums of.

    A code is g gray values, then p pairs. Over the training materials, each with its permutations
    of the channels, their mean is 0 and their covariance the identity.

    Parameters
    ----------
    hidden
        Hidden layers; a ReLU follows each.
    functions
        The output layer, its biases last, shape (units + 1, 1 + g + p), float32: the function that
        all materials have, those of the gray values, those of the pairs.
    grays
        g.
    examples
        Codes of the training materials, shape (m, k), float32: what materials are like.
    metadata
        JSON-able facts about the training.
    predictors
        Of lobes for importance sampling, by the kind of sampler; may be empty.

    Raises
    ------
    ValueError
        If layers do not chain, `grays` is out of range, or examples or a predictor are for other
        codes.
    """

    hidden: Sequence[Layer]
    functions: Weights
    greys: int
    examples: Weights
    metadata: dict[str, Any] = field(default_factory=dict)
    predictors: Mapping[str, LobePredictor] = field(default_factory=dict)

    def __post_init__(self) -> None:
        widths = [len(layer.biases) for layer in self.hidden]
        if [layer.weights.shape[0] for layer in self.hidden] != [6, *widths[:-1]]:
            raise ValueError("hidden layers do not chain")
        if self.functions.ndim != 2 or len(self.functions) != widths[-1] + 1:
            raise ValueError(f"functions {self.functions.shape} do not follow {widths[-1]} units")
        if not 0 <= self.greys < self.functions.shape[1] or not len(self):
            raise ValueError(f"{self.functions.shape[1]} functions with {self.greys} gray values")
        if self.examples.ndim != 2 or self.examples.shape[1] != len(self):
            raise ValueError(f"examples {self.examples.shape} are no codes of {len(self)} values")
        for name, predictor in self.predictors.items():
            if name != predictor.family or len(predictor.layers[0].weights) != len(self):
                raise ValueError(f"predictor {name!r} is not of {len(self)} values")

    def __len__(self) -> int:
        """Number of values in a code."""
        return self.greys + 2 * (int(self.functions.shape[1]) - 1 - self.greys)

    @property
    def nbytes(self) -> int:
        """Memory of the basis, which all materials share, predictors of lobes included."""
        parts = self.hidden, *(predictor.layers for predictor in self.predictors.values())
        layers = sum(layer.nbytes for part in parts for layer in part)
        return layers + self.functions.nbytes + self.examples.nbytes

    def values(self, inputs: Floats) -> Floats:
        """The functions at network inputs of shape (n, 6), shape (n, 1 + g + p)."""
        for layer in self.hidden:
            inputs = np.maximum(inputs @ layer.weights + layer.biases, 0.0)
        return np.asarray(inputs @ self.functions[:-1] + self.functions[-1])

    def logarithms(self, wi: npt.ArrayLike, wo: npt.ArrayLike) -> tuple[Weights, Weights]:
        """Of ln f_r at directions of shape (n, 3), what is linear in a code.

        Returns
        -------
        common
            ln f_r of the code 0, shape (n, 1).
        rows
            Derivatives by the values of a code, shape (k, n, 3).
        """
        values = self.values(isotropic_inputs(wi, wo, ENHANCED))
        common, grey, pairs = np.split(values, [1, 1 + self.greys], axis=1)
        chroma = np.einsum("np,qc->pqnc", pairs, CHROMA).reshape(-1, len(values), OUTPUTS)
        return common, np.concatenate([np.repeat(grey.T[..., None], OUTPUTS, axis=2), chroma])

    def shares(self, code: npt.ArrayLike) -> Double:
        """Weights of the functions in each channel, shape (1 + g + p, 3)."""
        values = np.asarray(code, np.float64)
        grey = np.repeat(values[: self.greys, None], OUTPUTS, axis=1)
        chroma = values[self.greys :].reshape(-1, 2) @ CHROMA
        return np.concatenate([np.ones((1, OUTPUTS)), grey, chroma])

    def reordered(self, codes: Floats, orders: int | npt.NDArray[np.int64]) -> Floats:
        """Codes (n, k) of the materials whose channels are those of `codes` in another order.

        Parameters
        ----------
        codes
            Shape (n, k).
        orders
            Which of :data:`nacre.numerics.channels.PERMUTATIONS`, shape (n,) or for all codes
            alike.
        """
        pairs = codes[:, self.greys :].reshape(len(codes), -1, 2) @ CHROMA_PERMUTATIONS[orders]
        return np.concatenate([codes[:, : self.greys], pairs.reshape(len(codes), -1)], axis=1)

    def decode(self, code: npt.ArrayLike, name: str = "") -> NeuralBasisBrdf:
        """The reflectance that a code stands for.

        Parameters
        ----------
        code
            Shape (k,). Whatever the values, f_r stays finite.
        name
            Of the material.

        Raises
        ------
        ValueError
            If the code has another length, or a value is a million or more.
        """
        return NeuralBasisBrdf(self, code, name)


class NeuralBasisBrdf(Brdf):
    """A code and the network that it stands for.

    Parameters
    ----------
    basis
        What the code belongs to.
    code
        Shape (k,); kept as float32.
    name
        Of the material.

    Raises
    ------
    ValueError
        If the code has another length, or a value is a million or more.
    """

    def __init__(self, basis: NeuralBasis, code: npt.ArrayLike, name: str = "") -> None:
        self.basis, self.code, self.name = basis, checked_code(code, len(basis)), name
        output = (basis.functions @ basis.shares(self.code)).astype(np.float32)
        self.layers = [*basis.hidden, Layer(output[:-1], output[-1])]
        check_weights(self.layers)

    @property
    def nbytes(self) -> int:
        """Bytes of the code: all materials share the basis."""
        return self.code.nbytes

    @cached_property
    def sampler(self) -> Sampler:  # type: ignore[override]  # a cached property can be replaced
        """Lobes that the basis predicts; without a predictor, lobes fitted to the material."""
        predict = self.basis.predictors.get(BEST_FAMILY)
        return predict(self.code) if predict else fit_lobes(self)

    def eval_components(self, wi: Components, wo: Components) -> Components:
        """See :class:`nacre.brdf.Brdf`; weights enter a Dr.Jit kernel as literals."""
        xp = namespace(*wi, *wo)
        values = list(network_inputs(wi, wo, True, ENHANCED))
        for index, layer in enumerate(self.layers):
            if index:
                values = [xp.maximum(v, 0.0) for v in values]
            values = xp.dense(values, layer.weights, layer.biases)
        red, green, blue = (xp.exp(xp.minimum(v, BRIGHTEST)) for v in values)
        return red, green, blue

    def describe(self) -> dict[str, Any]:
        """See :class:`nacre.brdf.Brdf`."""
        facts = super().describe() | code_facts(self.code, self.basis.nbytes)
        if BEST_FAMILY in self.basis.predictors:
            facts["sampler"] = f"predicted: {self.sampler}"
        return facts


def grown(common: Floats, rows: Floats, code: Floats) -> Floats:
    """f_r of a code from :meth:`NeuralBasis.logarithms`, in 1/sr."""
    logarithms = common + np.tensordot(code.astype(rows.dtype), rows, 1)
    return np.asarray(np.exp(np.minimum(logarithms, BRIGHTEST)))
