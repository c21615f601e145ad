"""The default codec: sums of smooth functions, whose coefficients a small network gives."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.btf.basis.functions import AngularFunctions
from nacre.btf.basis.posterior import Observation, Prior
from nacre.btf.basis.skip_network import SkipNetwork
from nacre.btf.codec import TexelCodec, TexelMap
from nacre.channels import join_colors

_REFINEMENTS = 4
"""Gauss-Newton steps of a code; more change the error in the fourth digit."""
_CHUNK = 512
"""Texels at a time whose codes are found."""


@dataclass(frozen=True, eq=False)
class BasisCodec(TexelCodec):
    """Texels as sums of smooth functions of light and view, with coefficients from few values.

    An apparent BRDF is a mean plus a sum of functions that a network has learned
    (:class:`AngularFunctions`). Its coefficients are what a second, small network makes of a code,
    once a texel; after that, a pair of directions costs one multiplication a coefficient. A code is
    the most likely one given all that is known of a texel, at whatever directions that is.

    Parameters
    ----------
    functions
        Of light and view.
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
    encode: SkipNetwork
    decode: SkipNetwork
    prior: Prior
    metadata: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        coefficients = self.functions.greys + 2 * self.functions.chromas
        shapes = [self.encode.linear.shape, self.decode.linear.shape[::-1]]
        if shapes != [(coefficients, self.values)] * 2:
            raise ValueError(f"networks of shapes {shapes} for {coefficients} coefficients")
        if len(self.prior.deviations) != self.functions.greys + self.functions.chromas:
            raise ValueError("deviations are not of as many coefficients")

    @property
    def values(self) -> int:  # type: ignore[override]
        """Values of a code."""
        return int(self.decode.linear.shape[0])

    def encoder(self, wi: Floats, wo: Floats) -> TexelMap:
        """See :meth:`TexelCodec.encoder`."""
        observation = Observation(self.functions(wi, wo))

        def encode(texels: Floats) -> Floats:
            return self._codes(observation, observation.moments(texels))

        return encode

    def _codes(self, observation: Observation, moments: Floats) -> Floats:
        codes = np.empty((len(moments), self.values), np.float32)
        for start in range(0, len(moments), _CHUNK):
            part = moments[start : start + _CHUNK]
            guess = self.encode(observation.ridge(part, self.prior))
            codes[start : start + _CHUNK] = observation.refine(
                guess, part, self.decode, self.prior, _REFINEMENTS
            )
        return codes

    def decoder(self, wi: Floats, wo: Floats) -> TexelMap:
        """See :meth:`TexelCodec.decoder`."""
        functions = self.functions(wi, wo)
        greys, chromas = self.functions.greys, self.functions.chromas

        def decode(codes: Floats) -> Floats:
            coefficients = self.decode(codes)
            grey = coefficients[:, :greys] @ functions.grey.T + functions.mean
            pairs = coefficients[:, greys:].reshape(-1, chromas) @ functions.chroma.T
            chroma = pairs.reshape(len(codes), 2, len(wi)).swapaxes(0, 1)
            return np.asarray(np.maximum(join_colors(grey, chroma), 0.0))

        return decode
