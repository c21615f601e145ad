"""Measured reflectance of the Material Definition Language: `.mbsdf` files.

NVIDIA Material Definition Language 1.2, Language Specification, Appendix B "MBSDF file format": a
line that names the format, lines of text, and for reflection and transmission a line that begins
the block, the type of its values (0 scalar, 1 RGB), the numbers of polar angles and of azimuths as
uint32, and the values as float32, all little-endian. Values are over theta_in, of the light and
slowest, theta_out and |phi_out - phi_in|, fastest: n even cells of [0, pi/2] and of [0, pi].
"""

from __future__ import annotations

import math
import struct
from pathlib import Path

import numpy as np
import numpy.typing as npt

from nacre.brdf import Brdf
from nacre.errors import FormatError
from nacre.io.binary import BinaryReader
from nacre.io.files import PathLike, atomic_path, read_bytes
from nacre.io.format import Format
from nacre.measured.mbsdf_table import NODE_LIMIT, SIZE_LIMIT, TEXT_LIMIT, MbsdfBrdf, Resolution
from nacre.measured.mbsdf_writer import tabulate
from nacre.measured.raw import check_finite

MAGIC = b"NVIDIA ARC MBSDF V1\n"
_REFLECTION = (b"MBSDF_DATA=\n", b"MBSDF_DATA_REFLECTION=\n")
_TRANSMISSION = b"MBSDF_DATA_TRANSMISSION=\n"


def load(path: PathLike) -> MbsdfBrdf:
    """Read an MDL ``.mbsdf`` file, whose name becomes the material's.

    A FormatError says that it cannot be read, holds transmission or nothing, or is damaged.
    """
    reader = BinaryReader(read_bytes(path, SIZE_LIMIT), path)
    if not _recognize(bytes(reader.data[: len(MAGIC)])):
        raise FormatError(f"{path}: does not begin with the line {MAGIC.decode().strip()}")
    remarks = _text(reader)
    values = _block(reader)
    if bytes(reader.data[reader.position :]).startswith(_TRANSMISSION):
        raise FormatError(
            f"{path}: holds transmission beside reflection; nacre reads files without"
        )
    if reader.position < len(reader.data):
        raise FormatError(f"{path}: has trailing bytes after the values; the file is damaged")
    check_finite(values, f"{path}: values", "download the file again")
    return MbsdfBrdf(values, Path(path).stem, remarks)


def _text(reader: BinaryReader) -> tuple[str, ...]:
    """The lines before the first block, which holds reflectance; moves behind its first line."""
    lines: list[str] = []
    reader.position = len(MAGIC)
    while True:
        end = reader.data.find(b"\n", reader.position, TEXT_LIMIT) + 1
        if not end:
            raise FormatError(f"{reader.path}: holds no values; the file is empty or cut short")
        line = bytes(reader.data[reader.position : end])
        reader.position = end
        if line in _REFLECTION:
            return tuple(lines)
        if line == _TRANSMISSION:
            raise FormatError(f"{reader.path}: holds transmission; nacre reads reflection only")
        if not (line.isascii() and line[:-1].decode().isprintable()):
            raise FormatError(f"{reader.path}: line {len(lines) + 2}: is not printable ASCII text")
        lines.append(line[:-1].decode())


def _block(reader: BinaryReader) -> npt.NDArray[np.float32]:
    """The values of a block, shape (theta_in, theta_out, phi, 1 or 3)."""
    kind, theta, phi = reader.take("<3I", "the header of the values")
    if kind > 1:
        raise FormatError(f"{reader.path}: type of the values: {kind}, expected 0 or 1")
    if not 1 <= theta <= NODE_LIMIT or not 1 <= phi <= NODE_LIMIT:
        raise FormatError(
            f"{reader.path}: header gives {theta} polar angles and {phi} azimuths, expected 1 to "
            f"{NODE_LIMIT}"
        )
    shape = theta, theta, phi, 3 if kind else 1
    start = reader.skip(4 * math.prod(shape), f"the values of a grid of {shape[:3]}")
    return np.frombuffer(reader.data, "<f4", math.prod(shape), start).reshape(shape)


def save(brdf: Brdf, path: PathLike, resolution: Resolution | None = None) -> None:
    """Write an MDL ``.mbsdf`` file of an isotropic reflectance, whole or not at all.

    An :class:`MbsdfBrdf` is written as it is, negative values and lines of text included, unless a
    resolution is given: what this function wrote comes back byte for byte. Anything else is
    tabulated first (see :func:`nacre.measured.mbsdf_writer.tabulate`).
    """
    table = brdf if isinstance(brdf, MbsdfBrdf) and not resolution else tabulate(brdf, resolution)
    _, theta, phi, channels = table.stored.shape
    text = "".join(f"{line}\n" for line in table.remarks).encode("ascii")
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        file.write(MAGIC + text + _REFLECTION[1])
        file.write(struct.pack("<3I", channels == 3, theta, phi))
        file.write(table.stored.astype("<f4").tobytes())


def _recognize(head: bytes) -> bool:
    return head.startswith(MAGIC)


FORMAT = Format("MDL", (".mbsdf",), _recognize, load, save, isotropic=True, resolution=Resolution)
