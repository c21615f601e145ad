"""What codes have in common, whatever basis they are of."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from nacre.array import Weights

LARGEST = 1e6
"""Bound of the values of a code and of the numbers of a basis: products of them stay finite."""


def checked_code(code: npt.ArrayLike, count: int) -> Weights:
    """A code of so many values, as float32.

    Raises
    ------
    ValueError
        If it has another length, or a value is a million or more.
    """
    values = np.asarray(code, np.float64)
    if values.shape != (count,) or not (np.abs(values) < LARGEST).all():
        raise ValueError(f"a code has {count} values below a million, got {values.shape}")
    return values.astype(np.float32)


def code_facts(code: Weights, basis_bytes: int) -> dict[str, int]:
    """What :meth:`nacre.brdf.Brdf.describe` says of a code and its basis."""
    return {"code values": len(code), "code bytes": code.nbytes, "basis bytes": basis_bytes}
