"""`.btf` files put together from the description of the format alone, field after field."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Any

import numpy as np

FIELDS: dict[str, Any] = {
    "magic": b"!DFMF08FCR",
    "size": None,
    "version": 4,
    "setup": b"dome",
    "sensor": b"camera",
    "light": b"LED",
    "per_mm": 9.5,
    "scale": (1.0, 1.0, 1.0),
    "cosine": 0,
    "xml": b"<a>&b;</a>",
    "xml_size": None,
    "channel_count": 3,
    "names": (b"R", b"G", b"B"),
    "name_size": None,
    "views": ((0.0, 0.0), (0.5, 1.0), (1.2, -2.0)),
    "lights": ((0.1, 0.0), (1.0, 2.0)),
    "view_count": None,
    "light_count": None,
    "width": 4,
    "height": 2,
    "rotations": ((1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),),
    "rotation_count": None,
    "most": 2,
    "model": 0,
    "mean": (0.1, 0.2, 0.3),
    "matrix": (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
    "scalar": 4,
    "k": 2,
    "k_stated": None,
    "rows": None,
    "columns": None,
    "swapped": False,
    "matrices": None,
    "end": b"",
}
"""Fields of a small file; None for what follows from the others."""


def factors(fields: Mapping[str, Any], seed: int = 0) -> list[list[np.ndarray]]:
    """Random S, U and SxV of three channels that fit a file of these fields."""
    random = np.random.default_rng(seed)
    pairs, texels = len(fields["views"]) * len(fields["lights"]), fields["width"] * fields["height"]
    rows, columns = (texels, pairs) if fields["swapped"] else (pairs, texels)
    k = fields["k"]
    return [
        [
            np.arange(k, 0.0, -1.0),
            random.uniform(0.1, 1.0, (rows, k)),
            random.uniform(0.1, 1.0, (columns, k)),
        ]
        for _ in range(3)
    ]


def _floats(values: Any) -> bytes:
    with np.errstate(over="ignore"):
        return np.asarray(values, np.float64).astype("<f4").tobytes()


def _count(stated: int | None, true: int) -> bytes:
    return ((true if stated is None else stated) % (1 << 32)).to_bytes(4, "little")


def btf_bytes(**changes: Any) -> bytes:
    """A file of :data:`FIELDS` with some of them changed."""
    f = FIELDS | changes
    notes = b"".join(f[name].ljust(80, b"\0") for name in ("setup", "sensor", "light"))
    notes += _floats(f["per_mm"]) + _floats(f["scale"])
    if f["version"] > 1:
        notes += _count(f["cosine"], 0)
    if f["version"] > 2:
        notes += _count(f["xml_size"], len(f["xml"])) + f["xml"]
    if f["version"] > 3:
        notes += _count(f["channel_count"], 3)
        notes += b"".join(_count(f["name_size"], len(name)) + name for name in f["names"])
    data = f["magic"] + _count(f["size"], 8 + len(notes)) + _count(f["version"], 4) + notes
    data += _count(f["view_count"], len(f["views"]))
    for view in f["views"]:
        data += _floats(view) + _count(f["light_count"], len(f["lights"])) + _floats(f["lights"])
    data += _count(f["width"], 0) + _count(f["height"], 0)
    data += _count(f["rotation_count"], len(f["rotations"])) + _floats(f["rotations"])
    data += _count(f["most"], 0) + _count(f["model"], 0) + _floats(f["mean"]) + _floats(f["matrix"])
    kind = {2: "<f2", 4: "<f4", 8: "<f8"}.get(f["scalar"], "<f4")
    for s, u, sxv in f["matrices"] or factors(FIELDS | {"k": f["k"], "swapped": f["swapped"]}):
        data += struct.pack("<B", f["scalar"]) + _count(f["k_stated"], f["k"])
        data += _count(f["rows"], len(u)) + _count(f["columns"], len(sxv))
        with np.errstate(over="ignore"):
            data += b"".join(part.astype(kind).tobytes() for part in (s, u, sxv))
    return bytes(data + f["end"])
