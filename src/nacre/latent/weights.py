"""Codes that stand for ordinary networks: the paper's inputs, two hidden layers of 21, 675 weights.

What such a code decodes into is a neural material like any other. It is saved, exported, sampled
and rendered as one, with no basis at hand.
"""

from __future__ import annotations

import abc
import itertools
import math
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from nacre.latent.codes import checked_code, code_facts
from nacre.neural.nbrdf import HIDDEN, OUTPUTS, NeuralBrdf, check_weights
from nacre.numerics.mlp import Layer
from nacre.sampling.fitted import LobeSampledBrdf

SIZES = (6, *HIDDEN, OUTPUTS)
SHAPES = tuple(itertools.pairwise(SIZES))
"""Inputs and outputs of each layer."""
COUNT = sum((rows + 1) * columns for rows, columns in SHAPES)
"""Weights and biases: 675."""
FARTHEST = 5.0
"""Root mean square of the values of a code beyond which only its direction counts."""

Matrix = npt.NDArray[np.float64]


class WeightBasis(abc.ABC):
    """What gives weights of a network for every code.

    Weights are laid out as the layers one after the other, of each the matrix by rows of inputs and
    then the biases.
    """

    LAYERS: ClassVar[tuple[str, ...]]
    """Names of its layers."""
    metadata: dict[str, Any]
    """JSON-able facts about the training."""

    @abc.abstractmethod
    def __len__(self) -> int:
        """Number of values in a code."""

    @property
    def layers(self) -> dict[str, Layer]:
        """The layers by name."""
        return {name: getattr(self, name) for name in self.LAYERS}

    @property
    def nbytes(self) -> int:
        """Memory of the basis, which all materials share."""
        return sum(layer.nbytes for layer in self.layers.values())

    def check_layers(self, **shapes: tuple[int, int]) -> None:
        """Refuse layers whose weights have other shapes than those of their names.

        Raises
        ------
        ValueError
            With the name of the layer.
        """
        for name, shape in shapes.items():
            found = self.layers[name].weights.shape
            if found != shape:
                raise ValueError(f"layer {name} is {found}, expected {shape}")

    @abc.abstractmethod
    def weights(self, codes: npt.ArrayLike) -> Matrix:
        """Weights of codes of shape (n, k), shape (n, 675), however long the codes are."""

    def decode(self, code: npt.ArrayLike, name: str = "") -> CodedNetwork:
        """The network that a code stands for.

        Parameters
        ----------
        code
            Shape (k,). Beyond a root mean square of 5 it stands for what the code of that length
            in the same direction stands for. Whatever the values, f_r is finite.
        name
            Of the material.

        Raises
        ------
        ValueError
            If the code has another length, or a value is a million or more.
        """
        return CodedNetwork(self, code, name)


class CodedNetwork(LobeSampledBrdf, NeuralBrdf):  # type: ignore[override]  # as in the former
    """A network and the code that stands for it.

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

    def __init__(self, basis: WeightBasis, code: npt.ArrayLike, name: str = "") -> None:
        self.basis, self.code = basis, checked_code(code, len(basis))
        layers = network_layers(basis.weights(shortened(self.code)[None])[0])
        check_weights(layers)
        super().__init__(layers, name=name)
        del self.__dict__["sampler"]  # so that lobes are fitted when they are first asked for

    def describe(self) -> dict[str, Any]:
        """See :class:`nacre.brdf.Brdf`."""
        return super().describe() | code_facts(self.code, self.basis.nbytes)


def shortened(code: npt.ArrayLike) -> Matrix:
    """A code, or if its root mean square is above 5 the one of that in the same direction."""
    values = np.asarray(code, np.float64)
    length = math.sqrt(np.square(values).mean())
    return values * (FARTHEST / max(length, FARTHEST))


def network_layers(weights: npt.ArrayLike) -> list[Layer]:
    """Layers of the 675 weights of a network, shape (675,)."""
    left = np.asarray(weights, np.float32)
    layers = []
    for rows, columns in SHAPES:
        matrix, biases, left = np.split(left, [rows * columns, (rows + 1) * columns])
        layers.append(Layer(matrix.reshape(rows, columns), biases))
    return layers


def flat_weights(layers: Sequence[Layer]) -> npt.NDArray[np.float32]:
    """The 675 weights of layers, shape (675,); undoes :func:`network_layers`."""
    return np.concatenate([a.reshape(-1) for x in layers for a in (x.weights, x.biases)])


def dense(values: Matrix, layer: Layer) -> Matrix:
    """A layer in double precision, for values of shape (..., inputs)."""
    found: Matrix = values @ layer.weights.astype(np.float64) + layer.biases
    return found


def bent(values: Matrix) -> Matrix:
    """The function x / (1 + e^-x), without overflow."""
    found: Matrix = 0.5 * values * (1.0 + np.tanh(0.5 * values))
    return found
