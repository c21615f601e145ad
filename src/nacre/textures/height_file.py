"""Height fields of textures in image files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.errors import FormatError, reason
from nacre.io.files import PathLike
from nacre.io.image_file import bitmaps, read_bitmap, write_exr

DEPTH = 0.1  # widths of a texture from black to white, where a file does not say
_EXACT = ".exr"


def check_height_map(path: PathLike) -> Path:
    """The path, if :func:`write_heights` can write it; to be called before the work.

    Raises a FormatError if the ending is not `.exr`, a MissingExtraError without Mitsuba.
    """
    path = Path(path)
    if path.suffix.lower() != _EXACT:
        raise FormatError(f"{path}: a height field that is written ends in {_EXACT}")
    bitmaps()
    return path


def write_heights(heights: Floats, path: PathLike) -> None:
    """Write heights in widths of the texture, shape (height, width), for a depth of 1.

    Raises a FormatError if the ending is not `.exr` or the file cannot be written, a
    MissingExtraError without Mitsuba.
    """
    path = check_height_map(path)
    values = np.ascontiguousarray(heights[:, :, None], np.float32)
    write_exr(bitmaps().Bitmap(values), path)


def full_depth(path: PathLike) -> float:
    """Widths of the texture from black to white, unless a user says otherwise: 1 for an OpenEXR
    image, whose values are heights; else :data:`DEPTH`.
    """
    return 1.0 if Path(path).suffix.lower() == _EXACT else DEPTH


def read_heights(path: PathLike) -> Any:
    """A gray image as heights, bytes as 0 to 1 without a display curve, shape (height, width).

    Raises a FormatError if it cannot be read or has too many pixels.
    """
    mi = bitmaps()
    try:
        bitmap = read_bitmap(path)
        bitmap.set_srgb_gamma(False)
        gray = bitmap.convert(mi.Bitmap.PixelFormat.Y, mi.Struct.Type.Float32, False)
        heights = np.array(gray, np.float32)
    except FormatError:
        raise
    except (RuntimeError, ValueError, MemoryError) as error:
        raise FormatError(f"{path}: height field cannot be read: {reason(error)}") from error
    if not heights.size or not np.isfinite(heights).all():
        raise FormatError(f"{path}: height field has no pixels, or some that are not finite")
    return heights.reshape(heights.shape[:2])
