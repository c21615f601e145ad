"""What every way of making texels into a few values can do."""

from __future__ import annotations

import abc
from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from nacre.array import Floats
from nacre.runtime.parallel import thread_map

TexelMap: TypeAlias = Callable[[Floats], Floats]

_PART = 64
"""Texels that one core takes at a time."""


class TexelCodec(abc.ABC):
    """Makes a code of a texel, at any directions, and reflectance of a code, at any others.

    What depends on the directions only is done once, then serves any number of texels.
    """

    values: int
    """Values of a code."""
    uses_all_cores: bool = False
    """Whether its maps share their work among the cores by themselves."""

    @abc.abstractmethod
    def encoder(self, wi: Floats, wo: Floats) -> TexelMap:
        """A function from texels known at n pairs of directions to their codes.

        It takes reflectance factors of shape (b, n, 3) and gives shape (b, :attr:`values`).

        Parameters
        ----------
        wi, wo
            Unit directions to the light and to the viewer, shape (n, 3).
        """

    @abc.abstractmethod
    def decoder(self, wi: Floats, wo: Floats) -> TexelMap:
        """A function from codes, shape (b, :attr:`values`), to reflectance factors (b, n, 3).

        Parameters
        ----------
        wi, wo
            Unit directions, shape (n, 3).
        """


def on_all_cores(codec: TexelCodec, run: TexelMap) -> TexelMap:
    """The same encoder or decoder of a codec, with texels shared among the cores.

    Numbers that overflow give no warning: results tell.
    """
    if codec.uses_all_cores:
        return run

    def quiet(texels: Floats) -> Floats:
        with np.errstate(over="ignore", invalid="ignore"):
            return run(texels)

    def shared(texels: Floats) -> Floats:
        if len(texels) <= _PART:
            return quiet(texels)
        starts = range(0, len(texels), _PART)
        parts = thread_map(lambda start: quiet(texels[start : start + _PART]), starts)
        result: Floats | None = None
        for start, part in zip(starts, parts, strict=True):
            if result is None:
                result = np.empty((len(texels), *part.shape[1:]), part.dtype)
            result[start : start + _PART] = part
        assert result is not None
        return result

    return shared
