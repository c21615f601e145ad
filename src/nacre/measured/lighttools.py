"""LightTools' BSDF files as text.

A header names azimuths and polar angles of scattered directions, from the normal; then there is a
table for each angle of incidence, side and color. The light comes from azimuth 90 degrees turned by
the plane of incidence. The layout is that which libbsdf's LightToolsBsdfReader reads.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from nacre.array import Floats
from nacre.color import xyz_to_rgb
from nacre.errors import FormatError, in_words
from nacre.geometry import from_spherical, join
from nacre.io.files import PathLike
from nacre.io.format import Format
from nacre.io.text_file import read_lines
from nacre.measured.deduplication import from_measurement
from nacre.measured.scattered import ScatteredBrdf
from nacre.measured.words import Words

_SIZE_LIMIT = 1 << 28
_TRISTIMULUS = {"trisx": 0, "trisy": 1, "trisz": 2}


@dataclass(eq=False)
class _Block:
    incidence: float = 0.0  # degrees
    plane: float = 0.0  # degrees
    side: str = "front"
    kind: str = "brdf"
    channel: int = 0
    values: Floats = field(default_factory=lambda: np.empty(0))


def load(path: PathLike) -> ScatteredBrdf:
    """Read the reflection of the front side in a ``.bsdf`` file of LightTools.

    Notes name what else the file holds. A FormatError says that the file cannot be read, holds no
    such reflection, or which word is wrong.
    """
    words = Words(path, _lines(path))
    header = _header(words)
    azimuths, polars = header
    blocks = list(_blocks(words, len(azimuths) * len(polars)))
    used = [b for b in blocks if (b.side, b.kind) == ("front", "brdf")]
    if not used:
        held = ", ".join(sorted({f"{b.kind.upper()} of the {b.side}" for b in blocks})) or "nothing"
        raise FormatError(f"{path}: holds no reflection of the front, but {held[:120]}")
    other = sorted(
        {f"the {b.kind.upper()} of the {b.side}" for b in blocks} - {"the BRDF of the front"}
    )
    lights: dict[tuple[float, float], dict[int, Floats]] = {}
    for block in used:
        lights.setdefault((block.incidence, block.plane), {})[block.channel] = block.values
    wi, wo, values = [], [], []
    for (incidence, plane), channels in lights.items():
        if set(channels) not in ({0}, {0, 1, 2}):
            raise FormatError(f"{path}: incidence {incidence:g}: has not all of X, Y and Z")
        phi, theta = np.meshgrid(np.radians(azimuths), np.radians(polars), indexing="ij")
        views = join(from_spherical(theta.reshape(-1), phi.reshape(-1)))
        turned = np.radians(90.0 + plane)
        light = np.stack(from_spherical(np.radians(incidence), turned))
        wi.append(np.broadcast_to(light, views.shape))
        wo.append(views)
        found = np.stack([channels[k] for k in sorted(channels)], axis=-1)
        values.append(xyz_to_rgb(found) if len(channels) == 3 else np.repeat(found, 3, axis=-1))
    planes = {plane for incidence, plane in lights if incidence > 0.0}
    notes = [f"The file also holds {in_words(other)}, which is left out."] if other else []
    return from_measurement(
        np.concatenate(wi),
        np.concatenate(wo),
        np.concatenate(values),
        Path(path).stem,
        where=f"{path}: tables",
        isotropic=len(planes) <= 1,
        notes=notes,
    )


def _lines(path: PathLike) -> Iterator[tuple[int, str]]:
    lines = read_lines(path, _SIZE_LIMIT)
    return ((number, line) for number, line in lines if not line.lstrip().startswith("#"))


def _header(words: Words) -> tuple[Floats, Floats]:
    """Azimuths and polar angles in degrees."""
    lists: dict[str, Floats] = {}
    while True:
        line, word = words.take("DataBegin")
        match word.lower():
            case "databegin":
                break
            case "scatterazimuth" | "scatterradial" as name:
                lists[name] = words.numbers(words.count(name), name)
            case "symmetry" | "spectralcontent" | "source" | "scattertype" | "version":
                words.take("a word")
            case _:
                raise words.error(f"line {line}: {word[:40]!r} is not known in the header")
    for name, limit in (("scatterazimuth", 360.0), ("scatterradial", 180.0)):
        if name not in lists:
            raise words.error(f"{name}: is missing before DataBegin")
        words.check_angles(lists[name], name, limit)
    return lists["scatterazimuth"], lists["scatterradial"]


def _blocks(words: Words, count: int) -> Iterator[_Block]:
    block = _Block()
    while True:
        line, word = words.take("DataEnd")
        match word.lower():
            case "dataend":
                words.end()
                return
            case "aoi":
                block.incidence = words.number("an angle of incidence")
                if not 0.0 <= block.incidence < 90.0:
                    raise words.error(f"line {line}: AOI {block.incidence:g}, expected 0 to 90")
            case "poi":
                block.plane = words.number("a plane of incidence")
            case "side":
                block.side = words.take("Front or Back")[1].lower()[:20]
            case "wavelength":
                words.number("a wavelength")
            case "scattertype":
                block.kind = words.take("BRDF or BTDF")[1].lower()[:20]
            case "tristimulusvalue":
                _, name = words.take("TrisX, TrisY or TrisZ")
                if name.lower() not in _TRISTIMULUS:
                    raise words.error(f"line {line}: {name[:40]!r}, expected TrisX, TrisY or TrisZ")
                block.channel = _TRISTIMULUS[name.lower()]
            case "tis":
                words.number("a total integrated scatter")
                block.values = words.numbers(count, "a table")
                yield block
                block = _Block()
            case _:
                raise words.error(f"line {line}: {word[:40]!r} is not known among tables")


def _recognize(head: bytes) -> bool:
    text = head.lower()
    return b"scatterradial" in text and b"symmetry" in text and b"samplerotation" not in text


FORMAT = Format("LightTools BSDF", (".bsdf",), _recognize, load)
