"""What every way of making texels into a few values can do."""

from __future__ import annotations

import abc
from collections.abc import Callable
from typing import TypeAlias

from nacre.array import Floats

TexelMap: TypeAlias = Callable[[Floats], Floats]


class TexelCodec(abc.ABC):
    """Makes a code of a texel, at any directions, and reflectance of a code, at any others.

    What depends on the directions only is done once, then serves any number of texels.
    """

    values: int
    """Values of a code."""

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
