"""Muon (Jordan et al. 2024): momentum whose singular values are made alike, for matrices.

PyTorch's own multiplies in bfloat16, which a CPU without such instructions does thirty times slower
than in single precision. Here products are in the type of the weights, and all but two of them are
of the smaller, square Gram matrix: each Newton-Schulz step multiplies the matrix X by a polynomial
of X X^T, and polynomials of one matrix commute, so that their product is found first.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any, TypeAlias

from nacre.errors import require

torch: Any = require("torch", "btf")
Tensor: TypeAlias = Any

_COEFFICIENTS = 3.4445, -4.7750, 2.0315
_STEPS = 5
_MOMENTUM = 0.95  # how much of the momentum stays at every step
_SMALLEST = 1e-7  # Frobenius norm that a momentum is divided by at least


def orthogonalized(matrix: Tensor) -> Tensor:
    """The nearest matrix whose singular values are all about 1, of any shape (m, n).

    Five Newton-Schulz steps with the quintic polynomial of Jordan et al.: singular values above
    some hundredths of the Frobenius norm end between 0.7 and 1.2.
    """
    wide = matrix.mT if matrix.shape[0] > matrix.shape[1] else matrix
    wide = wide / wide.norm().clamp(min=_SMALLEST)
    linear, cubic, quintic = _COEFFICIENTS
    gram = wide @ wide.mT
    product = None
    for _ in range(_STEPS):
        polynomial = torch.addmm(gram, gram, gram, beta=cubic, alpha=quintic)
        polynomial.diagonal().add_(linear)
        product = polynomial if product is None else polynomial @ product
        gram = polynomial @ (gram @ polynomial)
    found = product @ wide
    return found.mT if matrix.shape[0] > matrix.shape[1] else found


def like_adam(rows: int, columns: int) -> float:
    """Factor of the rate that makes steps as long as those of Adam (Liu et al. 2025)."""
    return 0.2 * math.sqrt(max(rows, columns))


def original(rows: int, columns: int) -> float:
    """Factor of the rate of Jordan et al. 2024."""
    return math.sqrt(max(1.0, rows / columns))


class Muon(torch.optim.Optimizer):  # type: ignore[misc]
    """Steps along the orthogonalized Nesterov momentum of matrices.

    `factor` is that of the rate, for a matrix with so many rows and columns.
    """

    def __init__(
        self,
        matrices: Iterable[Tensor],
        lr: float,
        factor: Callable[[int, int], float] = original,
    ) -> None:
        super().__init__(matrices, {"lr": lr})
        self._factor = factor

    @torch.no_grad()  # type: ignore[untyped-decorator]
    def step(self, closure: None = None) -> None:
        for group in self.param_groups:
            for matrix in group["params"]:
                if matrix.grad is None:
                    continue
                state = self.state[matrix]
                if not state:
                    state["momentum"] = torch.zeros_like(matrix)
                kept = state["momentum"].lerp_(matrix.grad, 1.0 - _MOMENTUM)
                ahead = orthogonalized(matrix.grad.lerp(kept, _MOMENTUM))
                matrix.add_(ahead, alpha=-group["lr"] * self._factor(*matrix.shape))
