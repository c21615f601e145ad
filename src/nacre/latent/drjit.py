"""Codes in Dr.Jit: what they stand for and how plausible they are, with gradients."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np

from nacre.array import Components
from nacre.brdf import above_horizon
from nacre.errors import NacreError, require
from nacre.latent.basis import LatentBasis
from nacre.latent.neural_basis import BRIGHTEST, NeuralBasis
from nacre.latent.prior import Prior
from nacre.neural.inputs import ENHANCED, network_inputs
from nacre.numerics.channels import CHROMA
from nacre.numerics.mlp import Layer, forward
from nacre.runtime.device import cooperative_type, matrix_views

dr: Any = require("drjit", "render")
nn: Any = require("drjit.nn", "render")
Float: TypeAlias = Any
"""An array of a differentiable JIT backend of Dr.Jit: `drjit.llvm.ad.Float` or CUDA's."""


class CodeSpace:
    """The codes of a neural basis for Dr.Jit.

    A code is an array of the k values, or a sequence of k arrays with one value per lane. The basis
    is fixed, and data of kernels: an optimization changes the code, and no kernel is compiled
    again.

    Raises NacreError if the basis is of another kind. Codes of a hypernetwork are those of its
    `basis`.
    """

    def __init__(self, basis: LatentBasis) -> None:
        if not isinstance(basis, NeuralBasis):
            raise NacreError(f"expected a neural basis, got one of the kind {basis.kind!r}")
        self.basis = basis
        self._layers: dict[type, list[tuple[Any, Any]]] = {}

    def decode(self, code: Float | Sequence[Float], wi: Components, wo: Components) -> Components:
        """f_r in 1/sr of a code, linear RGB, without the cosine, as three arrays.

        `wi` and `wo` are unit directions to the light and to the viewer, as vectors or three
        arrays. f_r is positive and at most a million; 0 where either direction is at or below the
        horizon.
        """
        values, basis = self._values(code), self.basis
        light, view = ((w[0], w[1], w[2]) for w in (wi, wo))
        rows = network_inputs(light, view, True, ENHANCED)
        array = type(values[0])
        state, kind = nn.CoopVec(*rows), cooperative_type(array)
        outputs = forward(state if kind is array else nn.cast(state, kind), self._weights(array))
        common, *functions = (array(x) for x in outputs)
        gray = common
        for value, function in zip(values, functions[: basis.luma], strict=False):
            gray = dr.fma(value, function, gray)
        channels = []
        for one, other in CHROMA.T.tolist():
            total = gray
            for index, function in enumerate(functions[basis.luma :]):
                first, second = values[basis.luma + 2 * index :][:2]
                total = dr.fma(one * first + other * second, function, total)
            channels.append(dr.exp(dr.minimum(total, BRIGHTEST)))
        red, green, blue = channels
        return above_horizon((red, green, blue), light, view)

    def log_prior(self, code: Float | Sequence[Float]) -> Float:
        """Natural logarithm of the density of codes, one per lane; see :class:`nacre.latent.Prior`.

        Computed on the CPU from the values of the code: it cannot be part of a recorded loop or
        call.
        """
        return dr.custom(_LogPrior, self.basis.prior, self._values(code))

    def _values(self, code: Float | Sequence[Float]) -> list[Float]:
        count = self.basis.code_dim
        if len(code) != count:
            raise ValueError(f"a code has {count} values, got {len(code)}")
        if not dr.is_array_v(code) or dr.depth_v(code) > 1:
            return list(code)
        index = dr.uint32_array_t(type(code))
        return [dr.gather(type(code), code, index(i)) for i in range(count)]

    def _weights(self, array: type) -> list[tuple[Any, Any]]:
        """The layers as cooperative vectors take them, made once per backend."""
        if not dr.is_jit_v(array):
            raise NacreError("codes take a JIT backend of Dr.Jit, as in the variant llvm_ad_rgb")
        if array not in self._layers:
            tensor = dr.tensor_t(cooperative_type(array))
            last = Layer(self.basis.functions[:-1], self.basis.functions[-1])
            parts = [
                tensor(part)
                for layer in (*self.basis.hidden, last)
                for part in (layer.weights.T.copy(), layer.biases)
            ]
            views = matrix_views(nn.pack(*parts, layout="training"))
            self._layers[array] = list(zip(views[::2], views[1::2], strict=True))
        return self._layers[array]


class _LogPrior(dr.CustomOp):  # type: ignore[misc]
    """The log density, whose derivatives are known."""

    def eval(self, prior: Prior, code: list[Float]) -> Float:
        self._array = type(code[0])
        lanes = np.broadcast_arrays(*(np.array(value, np.float64) for value in code))
        values = np.stack(lanes, axis=-1)
        self._slopes = [self._array(row.astype(np.float32)) for row in prior.slope(values).T]
        return self._array(prior.log_density(values).astype(np.float32))

    def forward(self) -> None:
        change = self.grad_in("code")
        pairs = zip(self._slopes, change, strict=True)
        self.set_grad_out(sum((slope * part for slope, part in pairs), self._array(0.0)))

    def backward(self) -> None:
        back = self.grad_out()
        self.set_grad_in("code", [slope * back for slope in self._slopes])

    def name(self) -> str:
        return "log prior"
