"""A reflectance known at pairs of directions of no particular order."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from nacre.array import ColorList, Colors, Doubles, Scalars, VectorList


@dataclass(frozen=True)
class DirectionSamples:
    """Values of a reflectance at pairs of unit directions above the horizon, shapes (n, 3).

    f_r is in 1/sr, linear Rec. 709 RGB; a negative channel is a color outside the gamut. `sigma` is
    the standard deviation of its noise in every channel, shape (n,), where that is known.
    `apertures` are half the angles of the cones of light and viewer over which f_r is the mean, in
    radians, shape (n, 2), where these are known; see :mod:`nacre.sampling.apertures`.
    """

    wi: VectorList
    wo: VectorList
    rgb: ColorList
    sigma: Scalars | None = None
    apertures: Doubles | None = None

    @property
    def cosine(self) -> Scalars:
        return self.wi[:, 2]

    def __len__(self) -> int:
        return len(self.rgb)

    def __getitem__(self, chosen: npt.NDArray[Any]) -> DirectionSamples:
        """The samples at an array of indices or where a mask is true."""
        sigma, apertures = (
            None if part is None else part[chosen] for part in (self.sigma, self.apertures)
        )
        arrays = self.wi[chosen], self.wo[chosen], self.rgb[chosen]
        return DirectionSamples(*arrays, sigma, apertures)


class Scattered(Protocol):
    """A reflectance known at scattered samples, which a fit takes as they are."""

    name: str
    isotropic: bool
    mirrored: bool
    """Whether f_r is unchanged when both directions are mirrored in a plane with the normal."""

    @property
    def samples(self) -> DirectionSamples:
        """Every sample."""

    def subset(self, chosen: npt.NDArray[Any]) -> Scattered:
        """The same kind of reflectance from the samples at an array of indices only."""

    def with_samples(self, samples: DirectionSamples) -> Scattered:
        """The same with other values at the same directions."""

    def nearest(self, wi: npt.ArrayLike, wo: npt.ArrayLike) -> npt.NDArray[np.int64]:
        """Index of the nearest sample to each pair of directions, shape (n,) for (n, 3)."""

    def eval(self, wi: npt.ArrayLike, wo: npt.ArrayLike) -> Colors:
        """See :meth:`nacre.Brdf.eval`."""


def loss_scale(gain: object) -> str:
    """What a loss with this gain compares, for people: "log(1 + 32 f cos)".

    Losses on different scales say nothing about each other. A scan has no gain: its held-out
    samples are compared as with a gain of 1.
    """
    factor = f"{gain:g} " if isinstance(gain, int | float) and gain != 1.0 else ""
    return f"log(1 + {factor}f cos)"
