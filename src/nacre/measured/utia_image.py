"""Materials of the UTIA BRDF database as images of 288 x 288 pixels.

Row 48 i + j from the top holds the light at theta_i = 15 i and phi_i = 7.5 j degrees, column 48 k +
l the view at theta_v = 15 k and phi_v = 7.5 l: the order of the raw files, see
:mod:`nacre.measured.utia`. That rows count from the top is how ALTA's plugin `utia`, based on code
by Filip, reads `.exr` files with OpenEXR. Mitsuba decodes the pixels, once the header is found to
promise no more than such an image.
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.brdf import Brdf
from nacre.color import srgb_to_linear
from nacre.errors import FormatError
from nacre.io.files import PathLike, first_bytes, read_bytes
from nacre.io.format import Format
from nacre.io.image_file import (
    EXR_MAGIC,
    HEADER_LIMIT,
    PNG_MAGIC,
    ImageHeader,
    bitmaps,
    decode,
    exr_header,
    png_header,
    write_exr,
)
from nacre.measured.raw import check_finite
from nacre.measured.utia import SHAPE, UtiaBrdf, tabulate

_EDGE = 288
_SIZE_LIMIT = 1 << 24  # bytes of a file: four times an image of float32 without compression
_EXR_HEADER = ImageHeader(_EDGE, _EDGE, frozenset("RGB"), 0)


def load_exr(path: PathLike) -> UtiaBrdf:
    """Read an ``.exr`` image of f_r in 1/sr, whose name becomes the material's.

    The file has one part in scan lines with channels R, G, B; a negative channel is not valid.
    """
    data = read_bytes(path, _SIZE_LIMIT)
    header = exr_header(data[:HEADER_LIMIT], path)
    _check_size(path, header)
    if header.channels != _EXR_HEADER.channels:
        found = ", ".join(sorted(header.channels)) or "none"
        raise FormatError(f"{path}: has other channels than R, G, B: {found!a}")
    values = decode(data, header, path).astype(np.float32)
    check_finite(values, f"{path}: pixels", "download the file again")
    return _material(values, path)


def load_png(path: PathLike) -> UtiaBrdf:
    """Read a ``.png`` image, a preview, clipped and quantized; its name becomes the material's.

    It has 8 or 16 bits per channel. Values follow the sRGB curve whatever the file says; the
    largest means f_r of 1/sr, or more.
    """
    data = read_bytes(path, _SIZE_LIMIT)
    header = png_header(data, path)
    _check_size(path, header)
    pixels = decode(data, header, path)
    return _material(srgb_to_linear(pixels / (2.0**header.bits - 1.0)), path)


def save_exr(brdf: Brdf, path: PathLike) -> None:
    """Write an ``.exr`` image of float32 values, whole or not at all.

    A :class:`UtiaBrdf` is written as it is, invalid samples included. Anything else is tabulated
    first (see :func:`nacre.measured.utia.tabulate`).
    """
    mi = bitmaps()
    utia = brdf if isinstance(brdf, UtiaBrdf) else tabulate(brdf)
    image = np.moveaxis(utia.stored.reshape(3, _EDGE, _EDGE), 0, -1)
    write_exr(mi.Bitmap(np.ascontiguousarray(image), mi.Bitmap.PixelFormat.RGB), path)


def _check_size(path: PathLike, header: ImageHeader) -> None:
    if (header.width, header.height) != (_EDGE, _EDGE):
        raise FormatError(
            f"{path}: has {header.width} x {header.height} pixels; the only images that are "
            f"materials are UTIA tables of {_EDGE} x {_EDGE}"
        )


def _is_exr_table(path: Path) -> bool:
    with suppress(FormatError):
        return exr_header(first_bytes(path, HEADER_LIMIT), path) == _EXR_HEADER
    return False


def _material(values: npt.NDArray[Any], path: PathLike) -> UtiaBrdf:
    return UtiaBrdf(np.moveaxis(values, -1, 0).reshape(SHAPE), Path(path).stem)


EXR = Format(
    "UTIA image (.exr)",
    (".exr",),
    lambda head: head.startswith(EXR_MAGIC),
    load_exr,
    save_exr,
    claims=_is_exr_table,
)
PNG = Format(
    "UTIA image (.png)",
    (".png",),
    lambda head: head.startswith(PNG_MAGIC),
    load_png,
    claims=lambda path: first_bytes(path)[12:24] == b"IHDR" + 2 * _EDGE.to_bytes(4, "big"),
)
"""Other images are refused when they are read."""
