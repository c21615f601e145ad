"""Intel's Open Image Denoise on the CPU, through the package `pyoidn`."""

from __future__ import annotations

import importlib.util
import sys
from typing import Any

import numpy as np

from nacre.array import Floats, Image
from nacre.errors import NacreError, require


def can_denoise() -> bool:
    """Whether the denoiser is installed: the extra `render` brings it where there is a wheel."""
    return importlib.util.find_spec("pyoidn") is not None


def denoise(picture: Floats, albedo: Floats, normals: Floats) -> Image:
    """A path traced picture without its noise; the same input gives the same bits on a machine.

    Parameters
    ----------
    picture
        Linear RGB, shape (height, width, 3), of samples that count for their own pixel only (a box
        filter): noise that neighbors share is kept.
    albedo
        Reflected fraction of light at what is seen first, in [0, 1]; shape as `picture`.
    normals
        Normals there, in any frame; shape as `picture`.

    Raises
    ------
    MissingExtraError
        If `pyoidn` is not installed.
    NacreError
        If the library fails.
    """
    images = [np.ascontiguousarray(image, np.float32) for image in (picture, albedo, normals)]
    np.clip(images[1], 0.0, 1.0, out=images[1])
    try:
        result: Image = _library().denoise(*images, hdr=True)
    except RuntimeError as error:
        raise NacreError(f"the denoiser failed: {error}; render without it") from error
    return result


def _library() -> Any:
    """The package; it would import PyTorch, which it needs for other devices and takes seconds."""
    if "torch" in sys.modules:
        return require("pyoidn", "render")
    sys.modules["torch"] = None  # type: ignore[assignment]
    try:
        return require("pyoidn", "render")
    finally:
        del sys.modules["torch"]
