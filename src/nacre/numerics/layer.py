"""A dense layer: what networks of all kinds are made of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True, eq=False)
class Layer:
    """One dense layer: `inputs @ weights + biases`.

    Parameters
    ----------
    weights
        Shape (inputs, outputs); kept as float32.
    biases
        Shape (outputs,); kept as float32.
    """

    weights: npt.NDArray[np.float32]
    biases: npt.NDArray[np.float32]

    def __post_init__(self) -> None:
        for name in ("weights", "biases"):
            array = np.ascontiguousarray(getattr(self, name), np.float32)
            object.__setattr__(self, name, array)
        shape = self.weights.shape
        if len(shape) != 2 or 0 in shape or self.biases.shape != shape[1:]:
            raise ValueError(f"weights {shape} and biases {self.biases.shape} are not a layer")

    @property
    def nbytes(self) -> int:
        """Memory of weights and biases."""
        return self.weights.nbytes + self.biases.nbytes
