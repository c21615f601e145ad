"""Codes that stand for ordinary networks: the paper's inputs, two hidden layers of 21, 675 weights.

Such a code decodes into a neural material like any other. It is saved, exported, sampled and
rendered as one, without the basis.
"""

from __future__ import annotations

import abc
import itertools
from collections.abc import Sequence
from typing import Any, ClassVar, TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.array import Doubles, Weights
from nacre.brdf import Brdf
from nacre.io.tensors import Tensors
from nacre.latent.basis import CodedBrdf, LatentBasis
from nacre.latent.directions import isotropic_inputs
from nacre.latent.neural_basis import PRIOR
from nacre.latent.picture_errors import PictureErrors
from nacre.latent.recipes import GAIN
from nacre.neural.inputs import PAPER
from nacre.neural.nbrdf import HIDDEN, OUTPUTS, NeuralBrdf, check_weights
from nacre.numerics.levenberg_marquardt import minimize
from nacre.numerics.mlp import Layer, forward, shaped_layers
from nacre.runtime.parallel import one_blas_thread
from nacre.sampling import LobeSampledBrdf

SIZES = (6, *HIDDEN, OUTPUTS)
SHAPES = tuple(itertools.pairwise(SIZES))  # inputs and outputs of each layer
COUNT = sum((rows + 1) * columns for rows, columns in SHAPES)  # weights and biases: 675
FARTHEST = 5.0  # root mean square of the values of a code beyond which only its direction counts

_STEPS = 8
_DIFFERENCE = 1e-4  # change of a value by which its effect on the weights is found
_LARGEST = 30.0  # bound of ln(f_r + 1) while a code is sought
_LARGEST_TRAINED = 15.0  # the same in training: no material comes near e^15

Tensor: TypeAlias = Any
AnyArray: TypeAlias = npt.NDArray[Any]


class WeightBasis(LatentBasis):
    """A basis that turns every code into the weights of a network, layer by layer: the matrix of
    each by rows of inputs, then its biases.
    """

    decodes_networks: ClassVar[bool] = True
    LAYERS: ClassVar[tuple[str, ...]]  # names of its layers

    @property
    def layers(self) -> dict[str, Layer]:
        return {name: getattr(self, name) for name in self.LAYERS}

    @property
    def nbytes(self) -> int:
        return sum(layer.nbytes for layer in self.layers.values())

    def check_layers(self, **shapes: tuple[int, int]) -> None:
        """Raise ValueError for a layer whose weights do not have the shape given by its name."""
        for name, shape in shapes.items():
            found = self.layers[name].weights.shape
            if found != shape:
                raise ValueError(f"layer {name} is {found}, expected {shape}")

    @abc.abstractmethod
    def weights(self, codes: npt.ArrayLike) -> Doubles:
        """Weights (n, 675) of codes of shape (n, k), however long the codes are."""

    def reflectances(self, codes: Weights, wi: npt.ArrayLike, wo: npt.ArrayLike) -> Weights:
        """f_r in 1/sr of codes (n, k) at pairs of directions (d, 3), shape (n, d, 3), float32."""
        inputs = isotropic_inputs(wi, wo, PAPER)
        networks = map(network_layers, self.weights(clipped(codes)))
        y = np.stack([forward(inputs, layers) for layers in networks])
        return np.asarray(np.maximum(np.expm1(np.minimum(y, _LARGEST)), 0.0), np.float32)

    @abc.abstractmethod
    def _start(self, brdf: Brdf, errors: PictureErrors) -> Doubles:
        """The code to refine."""

    def _refined(self, brdf: Brdf, seed: int) -> Doubles:
        with one_blas_thread():
            errors = PictureErrors(brdf, seed)
            return self.refined(errors, self._start(brdf, errors))

    def refined(self, errors: PictureErrors, start: npt.ArrayLike, prior: float = PRIOR) -> Doubles:
        """The code (k,) whose network comes closest to a material, near a start.

        The sum of the absolute errors and of the absolute values of the code, times `prior`, is
        minimized.
        """
        inputs = isotropic_inputs(errors.wi, errors.wo, PAPER)
        pull = prior * np.eye(self.code_dim)

        def weights(code: Doubles) -> Weights:
            return np.asarray(self.weights(clipped(code)[None])[0], np.float32)

        def residuals(code: Doubles) -> Doubles:
            y = forward(inputs, network_layers(weights(code)))
            return np.concatenate([errors.errors(np.expm1(np.minimum(y, _LARGEST))), prior * code])

        def jacobian(code: Doubles, _: Doubles) -> Doubles:
            tangents = weight_tangents(self, code).astype(np.float32)
            y, rates = with_tangents(network_layers(weights(code)), inputs, tangents)
            decoded = np.exp(np.minimum(y, _LARGEST))
            rates = rates * ((y < _LARGEST) * decoded)
            return np.concatenate([errors.slopes(decoded - 1.0, rates), pull], axis=1)

        limit = FARTHEST * np.sqrt(self.code_dim)
        return minimize(residuals, jacobian, np.asarray(start, np.float64), _STEPS, limit)[0]

    def decode(self, code: npt.ArrayLike, name: str = "") -> CodedNetwork:
        """The network that a code stands for; see :class:`nacre.latent.basis.LatentBasis`.

        Beyond a root mean square of 5, only the direction of a code counts.
        """
        return CodedNetwork(self, code, name)


class CodedNetwork(CodedBrdf, LobeSampledBrdf, NeuralBrdf):
    """A network and the code that stands for it; see :class:`CodedBrdf`."""

    def __init__(self, basis: WeightBasis, code: npt.ArrayLike, name: str = "") -> None:
        self.basis, self.code = basis, basis.checked(code)
        layers = network_layers(basis.weights(clipped(self.code)[None])[0])
        check_weights(layers)
        super().__init__(layers, name=name)


def clipped(code: npt.ArrayLike) -> Doubles:
    """Codes of shape (..., k), each clipped to a root mean square of 5."""
    values = np.asarray(code, np.float64)
    length = np.sqrt(np.square(values).mean(axis=-1, keepdims=True))
    return np.asarray(values * (FARTHEST / np.maximum(length, FARTHEST)))


def network_layers(weights: npt.ArrayLike) -> list[Layer]:
    """Layers of the 675 weights of a network, shape (675,)."""
    return shaped_layers(weights, SHAPES)


def named_tensors(layers: dict[str, Layer]) -> Tensors:
    return {
        f"{name}_{part}": array
        for name, layer in layers.items()
        for part, array in zip(("weights", "biases"), layer, strict=True)
    }


def named_layers(tensors: Tensors, names: Sequence[str]) -> dict[str, Layer]:
    """The inverse of :func:`named_tensors`."""
    return {name: Layer(tensors[f"{name}_weights"], tensors[f"{name}_biases"]) for name in names}


def weight_tangents(basis: WeightBasis, code: npt.ArrayLike) -> Doubles:
    """Derivatives of the weights of a code by its values, from differences, shape (k, 675)."""
    values = np.asarray(code, np.float64)
    offsets = _DIFFERENCE * np.eye(len(values))
    moved = np.stack([clipped(values + o) for o in (*offsets, *-offsets)])
    above, below = np.split(basis.weights(moved), 2)
    return (above - below) / (2.0 * _DIFFERENCE)


def sensitivity(weights: npt.ArrayLike, wi: Weights, wo: Weights) -> Doubles:
    """How far changes of weights move networks of materials, to first order: M, shape (675, 675).

    d M d is the squared change of log(1 + 30 f cos theta_i) by a change d of weights: its mean over
    directions, channels, networks, and permutations of their channels. `weights` are networks (n,
    675), `wi` and `wo` pairs of directions (m, 3).
    """
    inputs, cosine = isotropic_inputs(wi, wo, PAPER), GAIN * wi[:, 2:]
    total = np.zeros((COUNT, COUNT))
    networks = np.atleast_2d(np.asarray(weights, np.float32))
    for one in networks:
        y, rates = with_tangents(network_layers(one), inputs, np.eye(COUNT, dtype=np.float32))
        f_r = np.expm1(np.minimum(y, _LARGEST_TRAINED))
        slopes = (f_r + 1.0) * cosine / (1.0 + np.maximum(f_r, 0.0) * cosine)
        changes = (rates * slopes).reshape(COUNT, -1)
        total += changes @ changes.T / changes.shape[1]
    orders = [
        permuted(np.arange(COUNT)[None], p)[0] for p in itertools.permutations(range(OUTPUTS))
    ]
    mean = np.mean([total[np.ix_(order, order)] for order in orders], axis=0)
    return np.asarray(mean / len(networks))


def permuted(weights: AnyArray, permutation: Sequence[int]) -> AnyArray:
    """Networks with their channels in another order, shape (n, 675)."""
    rows, columns = SHAPES[-1]
    last = (rows + 1) * columns
    outputs = weights[:, -last:].reshape(len(weights), rows + 1, columns)[:, :, list(permutation)]
    return np.concatenate([weights[:, :-last], outputs.reshape(len(weights), last)], axis=1)


def with_tangents(
    layers: Sequence[Layer], inputs: Weights, tangents: Weights
) -> tuple[Weights, Weights]:
    """ln(f_r + 1) of a network, shape (n, 3), and its derivatives along `tangents`, (k, n, 3).

    Tangents are directions among weights, shape (k, 675).
    """
    values = inputs
    change = np.zeros((len(tangents), *inputs.shape), np.float32)
    start = 0
    for index, (matrix, biases) in enumerate(layers):
        if index:
            change *= values > 0.0
            values = np.maximum(values, 0.0)
        middle = start + matrix.size
        end = middle + biases.size
        of_matrix = tangents[:, start:middle].reshape(-1, *matrix.shape)
        change = change @ matrix + values @ of_matrix + tangents[:, None, middle:end]
        values = values @ matrix + biases
        start = end
    return values, change


def tensor_reflectance(weights: Tensor, inputs: Tensor) -> Tensor:
    """f_r in 1/sr of many networks in PyTorch as training sees it: bounded, not clamped at 0.

    `weights` are of shape (networks, 675), laid out as in :class:`WeightBasis`, `inputs` (n, 6);
    f_r is (networks, n, 3).
    """
    sizes = [part for rows, columns in SHAPES for part in (rows * columns, columns)]
    parts = weights.split(sizes, dim=1)
    layers = [
        (matrix.reshape(-1, *shape), biases)
        for shape, matrix, biases in zip(SHAPES, parts[::2], parts[1::2], strict=True)
    ]
    outputs = forward(inputs.expand(len(weights), -1, -1), layers)
    return outputs.clamp(max=_LARGEST_TRAINED).exp() - 1.0
