"""Tables over Rusinkiewicz angles as NumPy arrays: `.npz` archives and `.npy` files.

The grid and its missing samples are those of :mod:`nacre.measured.merl`; the values are f_r in 1/sr
rather than what a MERL file stores. There is no published standard: this is how such tables are
passed around in Python.
"""

from __future__ import annotations

import io
import re
import zipfile
from pathlib import Path

import numpy as np

from nacre.brdf import Brdf
from nacre.errors import FormatError
from nacre.io.files import PathLike, atomic_path, first_bytes, read_bytes
from nacre.io.format import Format
from nacre.io.npy import MAGIC, archive_errors, parse_npy, unpack_member
from nacre.measured.merl import NODE_LIMIT, Resolution, as_table
from nacre.measured.merl_table import SCALES, MerlBrdf
from nacre.measured.raw import LARGEST, check_finite

_KEY = "f_r"
_LIMIT = 1 << 30
_SHAPE = re.compile(rb"'shape': \((?:\d+, ){3}\d+\)")


def load_npz(path: PathLike) -> MerlBrdf:
    """Read the array `f_r` of an ``.npz`` archive, or its only array whatever the name.

    The file's name becomes the material's. For shapes see :func:`load_npy`.
    """
    data = read_bytes(path, _LIMIT)
    with archive_errors(path), zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = {m.filename: m for m in archive.infolist() if m.filename.endswith(".npy")}
        if f"{_KEY}.npy" not in members and len(members) != 1:
            raise FormatError(f"{path}: holds {len(members)} arrays and none is called '{_KEY}'")
        member = members.get(f"{_KEY}.npy") or next(iter(members.values()))
        where = f"{path}: array '{member.filename.removesuffix('.npy')[:80]}'"
        content = unpack_member(archive, member, len(data), where)
    return _table(content, where, Path(path).stem)


def load_npy(path: PathLike) -> MerlBrdf:
    """Read a table from an ``.npy`` file, whose name becomes the material's.

    The array has the shape (theta_h, theta_d, phi_d, 3) or (3, theta_h, theta_d, phi_d),
    90 x 90 x 180 nodes as a rule, and any floating-point type.
    """
    return _table(read_bytes(path, _LIMIT), str(path), Path(path).stem)


def save_npz(brdf: Brdf, path: PathLike, resolution: Resolution | None = None) -> None:
    """Write an ``.npz`` archive with `f_r` of shape (theta_h, theta_d, phi_d, 3), float64.

    A :class:`MerlBrdf` is written as it is, invalid samples included: what this function wrote
    comes back byte for byte. Anything else is tabulated first; see
    :func:`nacre.measured.merl.save`, whose parameters and errors these are.
    """
    merl = as_table(brdf, resolution)
    f_r = np.moveaxis(merl.stored, 0, -1) * np.asarray(SCALES)
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        np.savez(file, **{_KEY: f_r})


def _table(content: bytes, where: str, name: str) -> MerlBrdf:
    values = parse_npy(content, where)
    if values.ndim != 4 or 3 not in (values.shape[0], values.shape[3]):
        raise FormatError(f"{where}: has shape {values.shape}, expected (90, 90, 180, 3)")
    f_r = values if values.shape[3] == 3 else np.moveaxis(values, 0, -1)
    if not all(1 <= n <= NODE_LIMIT for n in f_r.shape[:3]):
        sizes = " x ".join(map(str, f_r.shape[:3]))
        raise FormatError(f"{where}: has {sizes} nodes, expected 90 x 90 x 180")
    with np.errstate(over="ignore", invalid="ignore"):  # of signalling NaN
        stored = f_r / np.asarray(SCALES)
    largest = LARGEST * (1.0 + 1e-9)  # what was multiplied by the scales when it was written
    check_finite(stored, f"{where}: values", "mark missing samples by -1", largest)
    return MerlBrdf(np.moveaxis(stored, -1, 0), name)


def _recognize_npz(head: bytes) -> bool:
    length = int.from_bytes(head[26:28], "little")
    return head.startswith(b"PK\3\4") and head[30 : 30 + length].endswith(b".npy")


def _recognize_npy(head: bytes) -> bool:
    return head.startswith(MAGIC) and _SHAPE.search(head) is not None


NPZ = Format(
    "MERL array (.npz)",
    (".npz",),
    _recognize_npz,
    load_npz,
    save_npz,
    isotropic=True,
    resolution=Resolution,
    claims=lambda path: _recognize_npz(first_bytes(path)),
)
NPY = Format(
    "MERL array (.npy)",
    (".npy",),
    _recognize_npy,
    load_npy,
    claims=lambda path: _recognize_npy(first_bytes(path)),
)
"""Networks in `.npy` files have no array of four axes."""
