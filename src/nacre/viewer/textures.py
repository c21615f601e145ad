"""Encoded textures for a page: few functions of light and view, and weights of them, in bytes.

They are the first of the factors in :mod:`nacre.textures.factors`. Weights are bytes, with a lowest
value and a step for each function; a coarser level is kept as its difference from means of the one
before. Functions vary slowly, so they are kept as cosines of light and view (a discrete cosine
transform along the four axes of the grid), rounded to steps that are larger the less a function
matters. Most are zeros, which compress well.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Array, Components, Floats, Image
from nacre.btf import Btf
from nacre.errors import NacreError
from nacre.mitsuba.lights import DirectionalLight
from nacre.runtime.progress import Progress, silent
from nacre.targets.glsl import GlslLanguage
from nacre.targets.program import Function
from nacre.targets.textures.accuracy import factors_error
from nacre.targets.textures.heights import HeightField
from nacre.targets.textures.shader_texture import encoded
from nacre.targets.textures.source import joined
from nacre.textures.factors import CHROMAS as ALL_CHROMAS
from nacre.textures.factors import LUMAS as ALL_LUMAS
from nacre.textures.factors import factor, grid_place
from nacre.textures.mipmap import level_shapes
from nacre.viewer.cosines import Cosines, differences

LUMAS, CHROMAS = 32, 4
"""Functions for luma and for both chroma values: as many as vertices can pass on to pixels."""
RESOLUTION = 16
"""Nodes along each axis of the grid of directions."""
LARGEST = 2048
"""Texels along an edge that every WebGL2 supports."""
_WEIGHT_STEP, _COSINE_STEP = 1.0 / 160.0, 1.0 / 24.0  # relative to the texture's mean luma
_SMALLEST = 1.0 / 200.0  # cosines of functions with smaller weights than this get no coarser

GLSL = "texture_glsl"
"""Key of a page's fact that names the part with :func:`formulas`."""

Bytes = npt.NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Rounded:
    """Numbers as bytes: `low` and `step`, of shape (k,), give those in column k of (n, k)."""

    values: Bytes
    low: Floats
    step: Floats

    @classmethod
    def of(cls, values: Floats, step: npt.NDArray[Any]) -> Rounded:
        """Numbers with steps of at least `step`, shape (k,)."""
        low = values.min(axis=0)
        steps = np.maximum(step, (values.max(axis=0) - low) / 255.0).astype(np.float32)
        return cls(np.clip(np.round((values - low) / steps), 0, 255).astype(np.uint8), low, steps)

    @property
    def numbers(self) -> Floats:
        """The numbers that the bytes stand for."""
        return np.asarray(self.low + self.step * self.values, np.float32)

    def facts(self) -> dict[str, list[float]]:
        """Lowest values and steps as JSON."""
        return {"low": self.low.tolist(), "step": self.step.tolist()}


@dataclass(frozen=True, eq=False)
class PageTexture:
    """A texture for a page.

    Parameters
    ----------
    height, width
        In texels.
    weights
        For texels of all levels, row by row, shape (t, :data:`LUMAS` + 2 :data:`CHROMAS`).
    functions
        At pairs of nodes of the grid of directions, :data:`LUMAS` + :data:`CHROMAS` of them.
    error
        Mean squared difference of reflectance factors from those of the codes.
    """

    height: int
    width: int
    weights: Rounded
    functions: Cosines
    error: float

    @classmethod
    def of(cls, texture: Btf, progress: Progress = silent) -> PageTexture:
        """An encoded texture for a page.

        Raises NacreError if it is not encoded, its codec works for its own directions only, or it
        is larger than :data:`LARGEST`.
        """
        latent = encoded(texture)
        height, width = latent.shape[:2]
        if max(height, width) > LARGEST:
            raise NacreError(
                f"{latent.name}: {width} x {height} texels; a page holds {LARGEST} x {LARGEST}"
            )
        found = factor(latent, RESOLUTION, len(level_shapes(height, width)), progress)
        starts = 0, ALL_LUMAS, ALL_LUMAS + ALL_CHROMAS
        kept = [
            np.arange(start, start + count)
            for start, count in zip(starts, (LUMAS, CHROMAS, CHROMAS), strict=True)
        ]
        weights = found.weights[:, np.concatenate(kept)]
        functions = found.functions[:, np.concatenate(kept[:2])]
        squares = np.square(weights[: height * width], dtype=np.float64).mean(axis=0)
        luma = np.sqrt(squares[:LUMAS].sum())
        pairs = squares[LUMAS:].reshape(2, CHROMAS).mean(axis=0)
        sizes = np.sqrt(np.concatenate([squares[:LUMAS], pairs]))
        coarse = _COSINE_STEP * luma / np.maximum(sizes, _SMALLEST * luma)
        # A black texture has no luma; the steps of its numbers have no meaning.
        rounded = Rounded.of(weights, np.full(weights.shape[1], max(_WEIGHT_STEP * luma, 1e-6)))
        cosines = Cosines.of(functions, np.maximum(np.nan_to_num(coarse), 1e-6))
        # As the page draws them: bytes between the least and the largest value of each function.
        drawn = Rounded.of(cosines.numbers, np.full(len(cosines.step), 1e-12)).numbers
        error = factors_error(latent, rounded.numbers[: height * width], drawn, LUMAS)
        return cls(height, width, rounded, cosines, error)

    def parts(self) -> dict[str, bytes]:
        """Weights by function and level, and functions, in the formats of `cosines.js`."""
        shapes = level_shapes(self.height, self.width)
        weights = np.ascontiguousarray(self.weights.values.T)
        return {
            "weights": differences(weights, shapes).tobytes(),
            "functions": self.functions.tobytes(),
        }

    def facts(self) -> dict[str, Any]:
        """How to read them, as JSON."""
        return {
            "width": self.width,
            "height": self.height,
            "lumas": LUMAS,
            "chromas": CHROMAS,
            "resolution": RESOLUTION,
            "scales": {
                "weights": self.weights.facts(),
                "functions": {"step": self.functions.step.tolist()},
            },
        }


def formulas() -> str:
    """GLSL for shaders of textures.

    `texture_place(w)` is a direction's place in the grid, and `texture_joined(sums)` reflectance
    factors from sums for luma and both chroma values.
    """

    def place(w: Components) -> tuple[tuple[Array, Array]]:
        return (grid_place(w, RESOLUTION),)

    functions = (
        Function.of("place", place, {"w": 3}, ("place",)),
        Function.of("joined", joined, {"sums": 3}, ("rgb",)),
    )
    return "\n\n".join(GlslLanguage().function(each, f"texture_{each.name}") for each in functions)


def relief(heights: HeightField) -> tuple[dict[str, Any], bytes]:
    """A height field for a page: its size and range as JSON, and heights as half floats."""
    pixels = heights.pixels
    rows, columns, _ = pixels.shape
    facts = {
        "width": columns,
        "height": rows,
        "bottom": float(pixels.min()),
        "top": float(pixels.max()),
    }
    return facts, pixels.astype("<f2").tobytes()


def from_above(texture: Btf) -> Image:
    """All of an encoded texture under the light of previews, linear RGB, (height, width, 3)."""
    light = np.array([DirectionalLight().direction], np.float32)
    seen = texture.at_directions(light, np.array([[0.0, 0.0, 1.0]], np.float32))
    return np.asarray(seen.images(slice(None))[0] * light[0, 2], np.float32)
