"""Integrals of functions of two variables, which may be narrow peaks."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nacre.array import Floats, Scalars

_ORDER = 8  # points of a rule along an edge of a box
_MAX_SPLITS = 12
_TOLERANCE = 1e-7  # of the integral over a box


def integrate(
    function: Callable[[Scalars, Scalars], Floats], boxes: Floats
) -> tuple[Floats, Floats]:
    """Integrals over boxes of two variables, by a rule of Gauss on boxes that are split as needed.

    Parameters
    ----------
    function
        From two variables, shapes (m,), to k values, shape (m, k).
    boxes
        Ranges x0, x1, y0, y1, shape (n, 4).

    Returns
    -------
    values, errors
        Shapes (n, k). The errors are those of the rule before the last split: bounds, as a rule.
    """
    owner = np.arange(len(boxes))
    whole = _rule(function, boxes)
    values, errors = np.zeros((2, *whole.shape))
    for split in range(_MAX_SPLITS):
        parts = _quarters(boxes)
        quarters = _rule(function, parts).reshape(len(boxes), 4, -1)
        better = quarters.sum(axis=1)
        error = np.abs(better - whole)
        done = (error <= _TOLERANCE).all(axis=1) | (split == _MAX_SPLITS - 1)
        np.add.at(values, owner[done], better[done])
        np.add.at(errors, owner[done], error[done])
        owner = np.repeat(owner[~done], 4)
        boxes = parts.reshape(-1, 4, 4)[~done].reshape(-1, 4)
        whole = quarters[~done].reshape(len(boxes), whole.shape[1])
        if not len(boxes):
            break
    return values, errors


def _quarters(boxes: Floats) -> Floats:
    """Four boxes of each, shape (4 n, 4)."""
    x0, x1, y0, y1 = boxes.T
    x, y = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
    parts = [(x0, x, y0, y), (x, x1, y0, y), (x0, x, y, y1), (x, x1, y, y1)]
    return np.array(parts).transpose(2, 0, 1).reshape(-1, 4)


def _rule(function: Callable[[Scalars, Scalars], Floats], boxes: Floats) -> Floats:
    """Integrals over boxes, shape (n, k), by a product of Gauss-Legendre rules."""
    nodes, weights = np.polynomial.legendre.leggauss(_ORDER)
    x0, x1, y0, y1 = (side[:, None, None] for side in boxes.T)
    x = 0.5 * (x0 + x1) + 0.5 * (x1 - x0) * nodes[:, None]
    y = 0.5 * (y0 + y1) + 0.5 * (y1 - y0) * nodes
    x, y = np.broadcast_arrays(x, y)
    found = function(x.ravel(), y.ravel()).reshape(len(boxes), _ORDER**2, -1)
    area = 0.25 * (boxes[:, 1] - boxes[:, 0]) * (boxes[:, 3] - boxes[:, 2])
    return area[:, None] * np.einsum("bpk,p->bk", found, np.outer(weights, weights).ravel())
