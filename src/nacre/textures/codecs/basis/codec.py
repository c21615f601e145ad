"""The default codec: sums of smooth functions, whose coefficients a small network gives."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.textures.codecs.basis.colors import join_reflectance
from nacre.textures.codecs.basis.networks import AngularFunctions, SkipNetwork
from nacre.textures.codecs.basis.posterior import Observation, Prior, project
from nacre.textures.codecs.codec import TexelCodec, TexelMap

_STEPS = 2
"""Gauss-Newton steps of a code; more lower the error by less than a thousandth."""
_CHUNK = 512
"""Texels at a time whose codes are found."""
_PAIRS = 1 << 9
"""Pairs of directions at a time that are decoded: few enough for the cache."""


@dataclass(frozen=True, eq=False)
class BasisCodec(TexelCodec):
    """Texels as sums of smooth functions of light and view, with coefficients from few values.

    The square root of an apparent BRDF is a mean plus a sum of functions that a network has learned
    (:class:`AngularFunctions`). Its coefficients are what a second, small network makes of a code,
    once a texel; after that, a pair of directions costs one multiplication a coefficient.

    Encoding takes any directions. Least squares give coefficients; a network completes them, given
    what share of each the directions determine; where they determine much, measurements override
    it; and Gauss-Newton steps bring the code closest to the outcome.

    Parameters
    ----------
    functions
        Of light and view.
    complete
        From coefficients by least squares, and what share of each is known, to those to expect.
    encode
        From coefficients to a first guess of the code.
    decode
        From a code to coefficients.
    prior
        Of codes, coefficients and noise.
    metadata
        How it was made.

    Raises
    ------
    ValueError
        If sizes do not match.
    """

    functions: AngularFunctions
    complete: SkipNetwork
    encode: SkipNetwork
    decode: SkipNetwork
    prior: Prior
    metadata: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        count = self.functions.greys + 2 * self.functions.chromas
        shapes = [self.encode.linear.shape, self.decode.linear.shape[::-1]]
        if shapes != [(count, self.values)] * 2:
            raise ValueError(f"networks of shapes {shapes} for {count} coefficients")
        if (len(self.complete.layers[0].weights), *self.complete.linear.shape) != (
            *(2 * count, count),
            count,
        ):
            raise ValueError(f"the network that completes is not for {count} coefficients")
        if self.prior.deviations.shape != (count,) or self.prior.covariance.shape != (count, count):
            raise ValueError(f"the prior is not of {count} coefficients")

    @property
    def values(self) -> int:  # type: ignore[override]
        """Values of a code."""
        return int(self.decode.linear.shape[0])

    def encoder(self, wi: Floats, wo: Floats) -> TexelMap:
        """See :meth:`TexelCodec.encoder`."""
        observation = Observation(self.functions(wi, wo), self.prior)
        complete = self.complete.given(observation.known)

        def encode(texels: Floats) -> Floats:
            moments = observation.moments(texels)
            codes = np.empty((len(texels), self.values), np.float32)
            for start in range(0, len(moments), _CHUNK):
                part = moments[start : start + _CHUNK]
                guess = complete(observation.ridge(part))
                wanted = observation.expected(guess, part)
                first = self.encode(wanted)
                codes[start : start + _CHUNK] = project(first, wanted, self.decode, _STEPS)
            return codes

        return encode

    def decoder(self, wi: Floats, wo: Floats) -> TexelMap:
        """See :meth:`TexelCodec.decoder`."""
        functions = self.functions(wi, wo)
        greys, chromas = self.functions.greys, self.functions.chromas

        def decode(codes: Floats) -> Floats:
            coefficients = self.decode(codes)
            values = np.empty((len(codes), len(wi), 3), np.float32)
            for start in range(0, len(wi), _PAIRS):
                part = slice(start, start + _PAIRS)
                grey = coefficients[:, :greys] @ functions.grey[part].T + functions.mean[part]
                chroma = coefficients[:, greys:].reshape(len(codes), 2, chromas).swapaxes(0, 1)
                chroma = chroma @ functions.chroma[part].T
                join_reflectance(grey, chroma, values[:, part])
            return values

        return decode
