"""Functions of directions from one network, and materials as sums of them.

The network sees the enhanced inputs of a pair of directions (:mod:`nacre.neural.inputs`); its
outputs take the place of the principal components of :mod:`nacre.latent.pca`. They need no grid,
take less than a hundredth of the memory, and are trained on what pictures show. ln f_r of a channel
is the sum of them, weighted by the code, so a material is a plain network of the shared hidden
layers and an output layer of its own.

Colors are handled by channel as there. A gray value weighs one function in all channels alike; a
pair of values stands for three weights of one function that sum to 0. So a permutation of the
channels of a material is one of its code, and no permuted material has to be trained on.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from nacre.array import Array, Components, Doubles, Floats, Weights, namespace
from nacre.brdf import Brdf, Sampler
from nacre.io.tensors import Tensors, check_numbers
from nacre.latent.basis import LARGEST, CodedBrdf, integer, integers
from nacre.latent.directions import isotropic_inputs
from nacre.latent.lobe_predictor import LobePredictor
from nacre.latent.picture_errors import PictureErrors
from nacre.latent.posterior import DARK, LOOSE, Linearized, Posterior, search
from nacre.latent.predicting import (
    PredictingBasis,
    numbered_layers,
    pack_predictors,
    unpack_predictors,
)
from nacre.latent.prior import Prior
from nacre.latent.recipes import BasisRecipe
from nacre.neural.chain_file import numbered_tensors
from nacre.neural.inputs import ENHANCED
from nacre.neural.nbrdf import OUTPUTS, check_weights
from nacre.neural.network import NetworkBrdf
from nacre.numerics.channels import CHROMA, CHROMA_PERMUTATIONS
from nacre.numerics.direction_samples import DirectionSamples
from nacre.numerics.levenberg_marquardt import minimize
from nacre.numerics.mlp import Layer, forward, widths
from nacre.runtime.parallel import one_blas_thread
from nacre.sampling import fit_lobes
from nacre.sampling.parametrizations import BEST

BRIGHTEST = math.log(1e6)  # bound of ln f_r: whatever a code holds, what it stands for is finite
PRIOR = 0.05  # what a standard deviation of a value costs, beside the sum of single errors
MAX_SAMPLES = 2048  # samples that count: a code learns nothing from more
_STEPS = 15
_FARTHEST = 100.0  # bound of the values that are found


@dataclass(frozen=True, eq=False, repr=False)
class NeuralBasis(PredictingBasis):
    """A network whose outputs are functions that materials are sums of.

    A code is g values of luma, then p pairs of chroma. Over the training materials, each with its
    permutations of the channels, their mean is 0 and their covariance the identity.

    Raises ValueError if layers do not chain, `luma` is out of range, or examples or a predictor are
    for other codes.
    """

    kind: ClassVar[str] = "neural"
    Recipe: ClassVar[type] = BasisRecipe
    trainer: ClassVar[str] = "nacre.latent.neural_training:train_neural"
    takes_samples: ClassVar[bool] = True
    linear_in_log: ClassVar[bool] = True

    hidden: Sequence[Layer]  # a ReLU follows each
    functions: Weights
    """The output layer, its biases last, shape (units + 1, 1 + g + p), float32: the function that
    all materials share, those of the luma, those of the chroma."""
    luma: int  # g
    examples: Weights  # codes of the training materials, shape (m, k), float32
    metadata: dict[str, Any] = field(default_factory=dict)
    predictors: Mapping[str, LobePredictor] = field(default_factory=dict)

    def __post_init__(self) -> None:
        sizes = widths(self.hidden)
        if sizes[0] != 6:
            raise ValueError(f"hidden layers take {sizes[0]} inputs, expected 6")
        if self.functions.ndim != 2 or len(self.functions) != sizes[-1] + 1:
            raise ValueError(f"functions {self.functions.shape} do not follow {sizes[-1]} units")
        if not 0 <= self.luma < self.functions.shape[1] or not self.code_dim:
            raise ValueError(f"{self.functions.shape[1]} functions, {self.luma} of them of luma")
        if self.examples.ndim != 2 or self.examples.shape[1] != self.code_dim:
            raise ValueError(f"examples {self.examples.shape} are no codes of {self.code_dim}")
        self.check_predictors()

    @property
    def code_dim(self) -> int:
        return self.luma + 2 * self.chroma

    @property
    def chroma(self) -> int:
        """p, the number of pairs in a code."""
        return int(self.functions.shape[1]) - 1 - self.luma

    @property
    def nbytes(self) -> int:
        layers = sum(layer.nbytes for layer in self.hidden) + self.predictor_bytes()
        return layers + self.functions.nbytes + self.examples.nbytes

    def values(self, inputs: Floats) -> Floats:
        """The functions at network inputs of shape (n, 6), shape (n, 1 + g + p)."""
        last = Layer(self.functions[:-1], self.functions[-1])
        return np.asarray(forward(inputs, [*self.hidden, last]))

    def logarithms(self, wi: npt.ArrayLike, wo: npt.ArrayLike) -> tuple[Weights, Weights]:
        """What is linear in a code about ln f_r at directions (n, 3): ln f_r of the code 0, shape
        (n, 1), and derivatives by the values of a code, shape (k, n, 3).
        """
        values = self.values(isotropic_inputs(wi, wo, ENHANCED))
        common, luma, pairs = np.split(values, [1, 1 + self.luma], axis=1)
        chroma = np.einsum("np,qc->pqnc", pairs, CHROMA).reshape(-1, len(values), OUTPUTS)
        return common, np.concatenate([np.repeat(luma.T[..., None], OUTPUTS, axis=2), chroma])

    def channel_weights(self, code: npt.ArrayLike) -> Doubles:
        """Weights of the functions in each channel, shape (1 + g + p, 3)."""
        values = np.asarray(code, np.float64)
        luma = np.repeat(values[: self.luma, None], OUTPUTS, axis=1)
        chroma = values[self.luma :].reshape(-1, 2) @ CHROMA
        return np.concatenate([np.ones((1, OUTPUTS)), luma, chroma])

    def permuted(self, codes: Floats, permutation: int | npt.NDArray[np.int64]) -> Floats:
        """Codes (n, k) of the same materials with their channels in another order: which of
        :data:`nacre.numerics.channels.PERMUTATIONS`, shape (n,) or one for all.
        """
        pairs = codes[:, self.luma :].reshape(len(codes), self.chroma, 2)
        turned = (pairs @ CHROMA_PERMUTATIONS[permutation]).reshape(len(codes), 2 * self.chroma)
        return np.concatenate([codes[:, : self.luma], turned], axis=1)

    def orders(self) -> Floats:
        every = [self.permuted(self.examples, index) for index in range(len(CHROMA_PERMUTATIONS))]
        return np.stack(every, axis=1)

    def reflectances(self, codes: Floats, wi: npt.ArrayLike, wo: npt.ArrayLike) -> Floats:
        values = self.values(isotropic_inputs(wi, wo, ENHANCED))
        weights = np.stack([self.channel_weights(code).T for code in codes]).astype(np.float32)
        return np.exp(np.minimum(weights @ values.T, BRIGHTEST)).transpose(0, 2, 1)

    @cached_property
    def prior(self) -> Prior:
        return Prior.about(self.orders())

    def _refined(self, brdf: Brdf, seed: int) -> Doubles:
        with one_blas_thread():
            return self.closest(PictureErrors(brdf, seed))

    def closest(self, errors: PictureErrors) -> Doubles:
        """The code that minimizes the sum of absolute errors and of its own absolute values."""
        pull = PRIOR * np.eye(self.code_dim, dtype=np.float32)
        common, rows = self.logarithms(errors.wi, errors.wo)

        def residuals(code: Doubles) -> Floats:
            own = (PRIOR * code).astype(np.float32)
            return np.concatenate([errors.errors(decoded(common, rows, code)), own])

        def jacobian(code: Doubles, _: Floats) -> Floats:
            f_r = decoded(common, rows, code)
            return np.concatenate([errors.slopes(f_r, rows * f_r), pull], axis=1)

        return minimize(residuals, jacobian, np.zeros(self.code_dim), _STEPS, _FARTHEST)[0]

    def _posterior(self, samples: DirectionSamples, free_scale: bool) -> Posterior:
        """Of samples only :data:`MAX_SAMPLES` count, the same each time.

        ln(f cos theta_i + e) is nearly linear in the code. Noise that samples state adds to what no
        code explains.
        """
        if not len(samples):
            raise ValueError("a code needs one sample or more")
        if len(samples) > MAX_SAMPLES:
            samples = samples[np.random.default_rng(0).permutation(len(samples))[:MAX_SAMPLES]]
        common, rows = (a.astype(np.float64) for a in self.logarithms(samples.wi, samples.wo))
        cosine = samples.cosine[:, None].astype(np.float64)
        target = np.log(np.maximum(samples.rgb, 0.0) * cosine + DARK)
        noise = 0.0 if samples.sigma is None else samples.sigma[:, None] * cosine
        if free_scale:
            rows = np.concatenate([rows, LOOSE * np.ones_like(rows[:1])])

        def linearized(mean: Doubles) -> Linearized:
            scaled = decoded(common, rows, mean) * cosine
            lit = scaled + DARK
            return Linearized(
                target - np.log(lit), rows * (scaled / lit), noise / lit + 0.0 * scaled
            )

        return self.inferred(linearized, extra=int(free_scale))

    def inferred(self, linearized: Callable[[Doubles], Linearized], extra: int = 0) -> Posterior:
        """What observations say of a code, and of `extra` values beside it.

        The prior assumes codes like those of the training materials, in any order of their
        channels; see :func:`nacre.latent.posterior.search`.
        """
        known = self.examples.astype(np.float64)
        centers = [self.permuted(known, p) for p in range(len(CHROMA_PERMUTATIONS))]
        return search(np.concatenate(centers), linearized, self.code_dim, extra)

    def decode(self, code: npt.ArrayLike, name: str = "") -> NeuralBasisBrdf:
        return NeuralBasisBrdf(self, code, name)

    def pack(self) -> tuple[dict[str, Any], Tensors]:
        tensors: Tensors = {
            name: np.ascontiguousarray(getattr(self, name)) for name in ("functions", "examples")
        }
        tensors |= numbered_tensors(self.hidden)
        own: dict[str, Any] = {"greys": self.luma, "hidden": list(widths(self.hidden)[1:])}
        fields, layers = pack_predictors(self.predictors)
        return own | fields, tensors | layers

    @classmethod
    def unpack(cls, header: Mapping[str, Any], tensors: Tensors) -> NeuralBasis:
        sizes = integers(header, "hidden")
        check_tensors(tensors)
        hidden = numbered_layers(tensors, len(sizes))
        if [len(layer.biases) for layer in hidden] != sizes:
            raise ValueError(f"layers are not as wide as {sizes}")
        predictors = unpack_predictors(header, tensors)
        functions, examples = tensors["functions"], tensors["examples"]
        luma, metadata = integer(header, "greys"), header["metadata"]
        return cls(hidden, functions, luma, examples, metadata, predictors)


class NeuralBasisBrdf(CodedBrdf, NetworkBrdf):
    """A code and the network that it stands for; see :class:`CodedBrdf`."""

    isotropy_known = True

    def __init__(self, basis: NeuralBasis, code: npt.ArrayLike, name: str = "") -> None:
        super().__init__(name=name)
        self.basis, self.code = basis, basis.checked(code)
        output = (basis.functions @ basis.channel_weights(self.code)).astype(np.float32)
        self.inputs, self.layers = ENHANCED, [*basis.hidden, Layer(output[:-1], output[-1])]
        self.shared_layers = len(basis.hidden)
        check_weights(self.layers)

    @property
    def nbytes(self) -> int:
        """Bytes of the code: all materials share the basis."""
        return self.code.nbytes

    @cached_property
    def sampler(self) -> Sampler:  # type: ignore[override]  # a cached property can be replaced
        """Lobes that the basis predicts, or without a predictor, lobes fitted to the material."""
        predict = self.basis.predictors.get(BEST)
        return predict(self.code) if predict else fit_lobes(self)

    def from_outputs(self, values: Sequence[Array]) -> Components:
        xp = namespace(*values)
        red, green, blue = (xp.exp(xp.minimum(v, BRIGHTEST)) for v in values)
        return red, green, blue

    def describe(self) -> dict[str, Any]:
        facts = super().describe()
        if BEST in self.basis.predictors:
            facts["sampler"] = f"predicted: {self.sampler}"
        return facts


def decoded(common: Floats, rows: Floats, code: Floats) -> Floats:
    """f_r of a code in 1/sr, from :meth:`NeuralBasis.logarithms`."""
    logarithms = common + np.tensordot(code.astype(rows.dtype), rows, 1)
    return np.asarray(np.exp(np.minimum(logarithms, BRIGHTEST)))


def check_tensors(tensors: Tensors) -> None:
    """Refuse, by name, tensors that are not float32 or whose products could overflow."""
    for name, array in tensors.items():
        if array.dtype != np.float32:
            raise ValueError(f"{name} is {array.dtype}, expected float32")
    check_numbers(tensors, LARGEST)
