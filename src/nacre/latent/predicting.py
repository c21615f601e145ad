"""Bases that predict lobes for importance sampling from their codes."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats, Weights
from nacre.io.tensors import Tensors
from nacre.latent.basis import LatentBasis, integer
from nacre.latent.lobe_predictor import LobePredictor
from nacre.neural.chain_file import numbered_tensors
from nacre.numerics.mlp import Layer

BY_LABELS = " by labels"
"""End of the name of a predictor that learned from lobes of fitted models; the rest is the family.
A predictor that learned by variance is named after the family alone."""


class PredictingBasis(LatentBasis):
    """A basis with :attr:`predictors`, and what they are trained on."""

    predictors: Mapping[str, LobePredictor] = MappingProxyType({})

    @abc.abstractmethod
    def orders(self) -> Floats:
        """Codes of the training materials with their channels in all six orders, shape (m, 6, k).

        m is 0 where the basis does not keep them.
        """

    @abc.abstractmethod
    def reflectances(self, codes: Floats, wi: npt.ArrayLike, wo: npt.ArrayLike) -> Floats:
        """f_r in 1/sr of codes (n, k) at pairs of directions (d, 3), shape (n, d, 3), float32."""

    def predictor_bytes(self) -> int:
        return sum(layer.nbytes for p in self.predictors.values() for layer in p.layers)

    def check_predictors(self) -> None:
        """Raise ValueError for a predictor of another family than its name tells, or for other
        codes.
        """
        for name, predictor in self.predictors.items():
            if family(name) != predictor.family or len(predictor.layers[0].weights) != (
                self.code_dim
            ):
                raise ValueError(f"predictor {name!r} is not for codes of {self.code_dim} values")

    def _without_predictors(self) -> LatentBasis:
        return self.replaced(predictors={})


def family(name: str) -> str:
    """The family of a predictor's lobes, from its name in a basis."""
    return name.removesuffix(BY_LABELS)


def pack_predictors(predictors: Mapping[str, LobePredictor]) -> tuple[dict[str, Any], Tensors]:
    """Fields of a header, none where nothing is predicted, and tensors."""
    tensors: Tensors = {}
    for name, predictor in predictors.items():
        tensors |= numbered_tensors(predictor.layers, _prefix(name))
    counts = {name: len(predictor.layers) for name, predictor in predictors.items()}
    return {"predictors": counts} if counts else {}, tensors


def unpack_predictors(header: Mapping[str, Any], tensors: Tensors) -> dict[str, LobePredictor]:
    """The inverse of :func:`pack_predictors`; KeyError or ValueError if something does not fit."""
    counts = header.get("predictors", {})
    if not isinstance(counts, dict):
        raise ValueError("predictors is not an object")
    return {
        name: LobePredictor(
            family(name), numbered_layers(tensors, integer(counts, name), _prefix(name))
        )
        for name in counts
    }


def numbered_layers(tensors: Tensors, count: int, prefix: str = "") -> list[Layer]:
    """The inverse of :func:`nacre.neural.chain_file.numbered_tensors`."""
    return [
        Layer(tensors[f"{prefix}weights_{index}"], tensors[f"{prefix}biases_{index}"])
        for index in range(1, count + 1)
    ]


def no_examples(code_dim: int) -> Weights:
    """What :meth:`PredictingBasis.orders` returns where a basis keeps no codes."""
    return np.zeros((0, 6, code_dim), np.float32)


def _prefix(name: str) -> str:
    return f"predictor {name} "
