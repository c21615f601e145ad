"""A texture codec: weighted sums of fixed functions of the two directions, a sum a channel.

It has what every codec needs, and little else: least squares with a prior, learned from textures.
Its entry point, in `pyproject.toml`:

    [project.entry-points."nacre.codecs"]
    cosines = "nacre_example.codec:CosineCodec"
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.io.tensors import Tensors, check_header, check_numbers
from nacre.textures.codecs import LinearBlock, TexelCodec, TexelMap, TrainingRun

VERSION = 1
FUNCTIONS = 7


@dataclass(frozen=True)
class CosineRecipe:
    """How the codec is trained.

    Parameters
    ----------
    texels
        Of each texture.
    seed
        Of the choice of texels.
    """

    texels: int = 64
    seed: int = 0


class CosineCodec(TexelCodec):
    """Reflectance as a sum of seven functions of cosines, with weights a texel and channel.

    Parameters
    ----------
    variances
        Mean squares of the weights, shape (7,).
    noise
        Variance of reflectance about the sums.
    metadata
        How these were found.
    """

    kind = "cosines"
    code_dim = 3 * FUNCTIONS

    def __init__(
        self, variances: Floats, noise: float, metadata: dict[str, Any] | None = None
    ) -> None:
        if variances.shape != (FUNCTIONS,) or not (variances > 0.0).all() or not noise > 0.0:
            raise ValueError(f"expected {FUNCTIONS} variances, and variances and noise above 0")
        self.variances, self.noise, self.metadata = variances, noise, metadata or {}

    def encoder(self, wi: Floats, wo: Floats) -> TexelMap:
        """See :class:`TexelCodec`: least squares with a ridge by the variances."""
        values = functions(wi, wo).astype(np.float64)
        normal = values.T @ values + np.diag(self.noise / self.variances)
        solve = np.linalg.solve(normal, values.T).astype(np.float32)

        def encode(texels: Floats) -> Floats:
            codes: Floats = np.einsum("kn,bnc->bkc", solve, texels).reshape(len(texels), -1)
            return codes

        return encode

    def decoder(self, wi: Floats, wo: Floats) -> TexelMap:
        """See :class:`TexelCodec`."""
        values = functions(wi, wo)

        def decode(codes: Floats) -> Floats:
            weights = codes.reshape(len(codes), FUNCTIONS, 3)
            return np.maximum(np.einsum("nk,bkc->bnc", values, weights), 0.0)

        return decode

    def pack(self, precision: str | None = "single") -> tuple[dict[str, Any], Tensors]:
        """See :class:`TexelCodec`; seven numbers are single in any precision."""
        header = {
            "version": VERSION,
            "model": self.kind,
            "noise": self.noise,
            "metadata": self.metadata,
        }
        return header, {"variances": self.variances}

    @classmethod
    def unpack(cls, header: dict[str, Any], tensors: Tensors) -> CosineCodec:
        """See :class:`TexelCodec`: a file may hold anything, so what is in it is checked."""
        check_header(header, VERSION)
        check_numbers(tensors, 1e9)
        return cls(tensors["variances"], float(header["noise"]), header["metadata"])

    def describe(self) -> dict[str, Any]:
        """What `nacre info` adds for this kind of codec."""
        return {"functions": FUNCTIONS}

    @classmethod
    def recipe(cls, *, texels: int = 64, seed: int = 0) -> CosineRecipe:
        """See :class:`TexelCodec`."""
        return CosineRecipe(texels, seed)

    @classmethod
    def train(cls, run: TrainingRun, recipe: CosineRecipe) -> CosineCodec:
        """See :class:`TexelCodec`: variances of weights that are found with hardly a prior."""
        start = cls(np.ones(FUNCTIONS, np.float32), 1e-3)
        random = np.random.default_rng(recipe.seed)
        squares, residuals = [], []
        for index, open_texture in enumerate(run.textures):
            texture = open_texture()
            count = min(recipe.texels, texture.texel_count)
            chosen = np.sort(random.choice(texture.texel_count, count, replace=False))
            texels = texture.texels(chosen)
            codes = start.encoder(texture.wi, texture.wo)(texels)
            decoded = start.decoder(texture.wi, texture.wo)(codes)
            squares.append(np.square(codes.reshape(-1, FUNCTIONS, 3)).mean((0, 2)))
            residuals.append(np.square(decoded - texels).mean())
            run.progress("training", index + 1, len(run.textures), "")
        facts = {"materials": [Path(p).stem for p in run.paths], "training": asdict(recipe)}
        variances = np.mean(squares, axis=0).astype(np.float32) + np.float32(1e-6)
        return cls(variances, float(np.mean(residuals)) + 1e-6, facts)

    def linear_blocks(self, wi: Floats, wo: Floats) -> list[LinearBlock]:
        """With these, `nacre btf plan` chooses directions for the codec."""
        variances = self.variances.astype(np.float64)
        return [LinearBlock(functions(wi, wo), variances, self.noise, channels=3)]


def functions(wi: Floats, wo: Floats) -> Floats:
    """The functions at pairs of directions, shape (n, 7)."""
    half = wi + wo
    half = half / np.linalg.norm(half, axis=1, keepdims=True)
    light, view, tilt = wi[:, 2], wo[:, 2], half[:, 2]
    columns = [np.ones_like(light), light, view, light * view, tilt, tilt**8, tilt**64]
    return np.stack(columns, axis=1).astype(np.float32)
