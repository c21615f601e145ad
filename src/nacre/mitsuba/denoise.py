"""Intel's Open Image Denoise on the CPU, through the package `pyoidn`."""

from __future__ import annotations

import importlib.util
import sys
from typing import Any

import numpy as np

from nacre.array import Floats, Image
from nacre.errors import NacreError, reason, require


def can_denoise() -> bool:
    """Whether the denoiser is installed: the extra `render` brings it where there is a wheel."""
    return importlib.util.find_spec("pyoidn") is not None


def denoise(picture: Floats, albedo: Floats, normals: Floats) -> Image:
    """Remove the noise of a path traced picture; repeatable to the bit on one machine.

    The picture, linear RGB, must be rendered with a box filter: noise that neighboring pixels share
    stays. Albedo, in [0, 1], and normals, in any frame, are those of the first hit. All have shape
    (height, width, 3). Raises MissingExtraError without `pyoidn`, NacreError if the library fails.
    """
    images = [np.ascontiguousarray(image, np.float32) for image in (picture, albedo, normals)]
    np.clip(images[1], 0.0, 1.0, out=images[1])
    try:
        result: Image = _library().denoise(*images, hdr=True)
    except RuntimeError as error:
        raise NacreError(f"the denoiser failed: {reason(error)}; render without it") from error
    return result


def _library() -> Any:
    """`pyoidn` without PyTorch, which it needs for other devices only and takes seconds to load."""
    if "torch" in sys.modules:
        return require("pyoidn", "render")
    sys.modules["torch"] = None  # type: ignore[assignment]
    try:
        return require("pyoidn", "render")
    finally:
        del sys.modules["torch"]
