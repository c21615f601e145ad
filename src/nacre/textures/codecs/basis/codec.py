"""The default codec: sums of smooth functions, whose coefficients a small network gives."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.io.tensors import HALF_LARGEST, Tensors, check_header, in_precision, in_single
from nacre.measured.textures.domes import pairs
from nacre.numerics.mlp import widths
from nacre.runtime.store import Store
from nacre.textures.codecs.basis.colors import join_reflectance
from nacre.textures.codecs.basis.fields import pack_fields, unpack_fields
from nacre.textures.codecs.basis.networks import AngularFunctions, FunctionValues, SkipNetwork
from nacre.textures.codecs.basis.posterior import Observation, Prior, project
from nacre.textures.codecs.basis.recipe import VERSION, BasisRecipe
from nacre.textures.codecs.codec import Coder, LinearBlock, TexelCodec, TexelMap, TrainingRun

_STEPS = 2  # Gauss-Newton steps of a code; more lower the error by less than a thousandth
_CHUNK = 512  # texels at a time whose codes are found
_PAIRS = 1 << 9  # pairs of directions at a time that are decoded: few enough for the cache
_VALUES = "roots of pi f_r, linear Rec. 709, as grey values and pairs of colours"
"""Stays as it is: maps of texels know their codec by the hash of its header and weights."""
_EXACT = "prior."
"""What is single in every file, as is what half cannot hold: inverses magnify rounding."""
_LARGEST = 1e9  # weights of coefficients that hardly vary in the training data are large
_MAX_WIDTH, _MAX_FUNCTIONS, _MAX_CODE_DIM = 1 << 13, 1 << 10, 1 << 10


@dataclass(frozen=True, eq=False)
class BasisCodec(TexelCodec):
    """Texels as sums of smooth functions of light and view, with coefficients from few values.

    The square root of an apparent BRDF is a mean plus a sum of functions that a network has learned
    (:class:`AngularFunctions`). A second, small network gives the coefficients from a code, once
    per texel; after that, a pair of directions costs one multiplication per coefficient.

    Encoding takes any directions. Least squares give coefficients; the network `complete` takes
    these, and the fraction of each that the directions determine, and gives those to expect; where
    the directions determine much, measurements override it. `encode` makes a first guess of the
    code from the outcome, and Gauss-Newton steps bring what `decode` gives closest to it. The prior
    is that of codes, coefficients and noise.

    A ValueError says that sizes do not match.
    """

    functions: AngularFunctions
    complete: SkipNetwork
    encode: SkipNetwork
    decode: SkipNetwork
    prior: Prior
    metadata: dict[str, Any] = field(default_factory=dict)

    kind = "basis"
    hit_form = "functions"
    takes_half = True
    encoded_together = 128  # among which the functions are shared, which lie far from the cores

    def __post_init__(self) -> None:
        count = self.expanded_dim
        shapes = [self.encode.linear.shape, self.decode.linear.shape[::-1]]
        if shapes != [(count, self.code_dim)] * 2:
            raise ValueError(f"networks of shapes {shapes} for {count} coefficients")
        seen = len(self.complete.layers[0].weights)
        if (seen, *self.complete.linear.shape) != (2 * count, count, count):
            raise ValueError(f"the network that completes is not for {count} coefficients")
        if self.prior.deviations.shape != (count,) or self.prior.covariance.shape != (count, count):
            raise ValueError(f"the prior is not for {count} coefficients")

    @property
    def code_dim(self) -> int:  # type: ignore[override]
        return int(self.decode.linear.shape[0])

    @property
    def expanded_dim(self) -> int:  # type: ignore[override]
        """Number of coefficients: for luma, and for both values of chroma."""
        return self.functions.luma_count + 2 * self.functions.chroma_count

    def encoder(self, wi: Floats, wo: Floats) -> TexelMap:
        return self._encoder(self.functions(wi, wo))

    def coder(self, wi: Floats, wo: Floats) -> Coder:
        functions = self.functions(wi, wo)
        return Coder(self._encoder(functions), lambda chosen: self._decoder(functions.at(chosen)))

    def _encoder(self, functions: FunctionValues) -> TexelMap:
        observation = Observation(functions, self.prior)
        complete = self.complete.given(observation.known)

        def encode(texels: Floats) -> Floats:
            moments = observation.moments(texels)
            codes = np.empty((len(texels), self.code_dim), np.float32)
            for start in range(0, len(moments), _CHUNK):
                part = moments[start : start + _CHUNK]
                guess = complete(observation.ridge(part))
                codes[start : start + _CHUNK] = self._short(observation.expected(guess, part))
            return codes

        return encode

    def _short(self, wanted: Floats) -> Floats:
        if self.decode.is_identity:
            return wanted
        return project(self.encode(wanted), wanted, self.decode, _STEPS)

    def expanded(self) -> BasisCodec:
        same = SkipNetwork.identity(self.expanded_dim)
        return self.replaced(encode=same, decode=same)

    def coefficients(self, codes: Floats) -> Floats:
        return codes if self.decode.is_identity else self.decode(codes)

    def shortened(self, coefficients: Floats) -> Floats:
        parts = range(0, len(coefficients), _CHUNK)
        return np.concatenate([self._short(coefficients[k : k + _CHUNK]) for k in parts])

    def decoder(self, wi: Floats, wo: Floats) -> TexelMap:
        return self._decoder(self.functions(wi, wo))

    def _decoder(self, functions: FunctionValues) -> TexelMap:
        luma_count, chroma_count = self.functions.luma_count, self.functions.chroma_count

        def decode(codes: Floats) -> Floats:
            coefficients = self.decode(codes)
            values = np.empty((len(codes), len(functions.mean), 3), np.float32)
            for start in range(0, len(functions.mean), _PAIRS):
                part = slice(start, start + _PAIRS)
                luma = coefficients[:, :luma_count] @ functions.luma[part].T + functions.mean[part]
                chroma = coefficients[:, luma_count:].reshape(len(codes), 2, chroma_count)
                chroma = chroma.swapaxes(0, 1) @ functions.chroma[part].T
                join_reflectance(luma, chroma, values[:, part])
            return values

        return decode

    def embedding(self, wi: Floats, wo: Floats) -> TexelMap:
        """Of all pairs, before values below black are cut off."""
        gram = Observation(self.functions(wi, wo), self.prior).gram / (3 * len(wi))
        variances, vectors = np.linalg.eigh(gram)
        factor = (vectors * np.sqrt(np.maximum(variances, 0.0))).astype(np.float32)
        return lambda codes: self.decode(codes) @ factor

    def linear_blocks(self, wi: Floats, wo: Floats) -> list[LinearBlock]:
        """Coefficients are taken to be independent."""
        functions, luma_count = self.functions(wi, wo), self.functions.luma_count
        variances = self.prior.deviations.astype(np.float64) ** 2
        # Both values of chroma have the same functions, hence the same variances.
        chroma = variances[luma_count : luma_count + self.functions.chroma_count]
        return [
            LinearBlock(functions.luma, variances[:luma_count], self.prior.noise),
            LinearBlock(functions.chroma, chroma, self.prior.noise, 2),
        ]

    def describe(self) -> dict[str, Any]:
        functions = self.functions
        networks = {
            "functions": [*functions.hidden, functions.wide, functions.last],
            "completion": self.complete.layers,
            "encoder": self.encode.layers,
            "decoder": self.decode.layers,
        }
        return {
            "luma functions": functions.luma_count,
            "chroma functions": functions.chroma_count,
            **{f"layers, {name}": list(widths(layers)) for name, layers in networks.items()},
        }

    def pack(self, precision: str | None = "single") -> tuple[dict[str, Any], Tensors]:
        numbers, tensors = pack_fields(self)
        metadata = numbers.pop("metadata")
        written: Tensors = {}
        for name, array in tensors.items():
            exact = name.startswith(_EXACT) or np.abs(array).max() >= HALF_LARGEST
            written |= in_precision({name: array}, "single" if exact else precision, _LARGEST)
        header = {"version": VERSION, "model": self.kind, "numbers": numbers, "values": _VALUES}
        return header | {"metadata": metadata}, written

    @classmethod
    def unpack(cls, header: dict[str, Any], tensors: Tensors) -> BasisCodec:
        check_header(header, VERSION)
        metadata, numbers = header["metadata"], header["numbers"]
        if not isinstance(numbers, dict):
            raise ValueError("numbers are not an object")
        single: Tensors = {}
        for name, array in tensors.items():
            if max(array.shape, default=0) > _MAX_WIDTH:
                raise ValueError(f"{name} is {array.shape}, wider than {_MAX_WIDTH:,}")
            single |= in_single({name: array}, _LARGEST)
        codec = unpack_fields(BasisCodec, {**numbers, "metadata": metadata}, single)
        functions = len(codec.functions.last.biases)
        if not 1 <= codec.code_dim <= _MAX_CODE_DIM or functions > _MAX_FUNCTIONS:
            raise ValueError(f"latent size {codec.code_dim:,} or {functions:,} functions: too many")
        _try(codec)
        return codec

    @classmethod
    def recipe(
        cls, *, code_dim: int | None = None, steps: int | None = None, seed: int = 0
    ) -> BasisRecipe:
        """How to train a codec with `code_dim` values per code, 32 where None, in so many steps of
        both stages together.

        A NacreError says that codes would have more values than there are coefficients.
        """
        return BasisRecipe.of(code_dim, steps, seed)

    @classmethod
    def train(cls, run: TrainingRun, recipe: BasisRecipe) -> BasisCodec:
        from nacre.textures.codecs.basis.training import train_parts  # needs PyTorch

        names = [Path(path).stem for path in run.paths]
        facts = {"materials": names, "training": asdict(recipe), "steps": recipe.steps}
        return cls(*train_parts(run, recipe), facts)

    @classmethod
    def state_files(cls, state: Path) -> list[Path]:
        return [path for path in Store(state).files() if path != state]


def _try(codec: BasisCodec) -> None:
    directions: Floats = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]], np.float32)
    wi, wo = pairs(directions, directions)
    with np.errstate(all="ignore"):
        codes = codec.encoder(wi, wo)(np.full((1, len(wi), 3), 0.5, np.float32))
        values = codec.decoder(wi, wo)(codes)
    if codes.shape != (1, codec.code_dim) or values.shape != (1, len(wi), 3):
        raise ValueError(f"gives codes {codes.shape} and values {values.shape} of one texel")
    if not (np.isfinite(codes).all() and np.isfinite(values).all()):
        raise ValueError("encodes a gray texel as numbers that are not finite")
