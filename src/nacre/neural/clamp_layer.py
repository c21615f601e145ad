"""Networks that cannot exceed a bound, whatever the directions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from nacre.numerics.mlp import Layer


def bounded(layers: Sequence[Layer], highest: npt.ArrayLike) -> list[Layer]:
    """Layers of the network min(f_r, highest), exact and everywhere.

    One more ReLU layer, of three units, does it: min(x, c) = c - max(c - x, 0), with x the output
    before exp(x) - 1 and c = log(1 + highest).

    Parameters
    ----------
    layers
        An NBRDF.
    highest
        The bound of red, green and blue in 1/sr, shape (3,).
    """
    *hidden, last = layers
    cap = np.log1p(np.asarray(highest, np.float32))
    below = Layer(-last.weights, cap - last.biases)
    return [*hidden, below, Layer(-np.eye(len(cap), dtype=np.float32), cap)]
