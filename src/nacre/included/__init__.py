"""Materials that come with nacre, with names such as `rgl:paper_white` in place of files.

Each family is a folder here, with one file per material and a file of terms, whose lines tell what
the family is, where it comes from and its license. `scripts/included.py` makes them.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal

import safetensors

from nacre.errors import FormatError, did_you_mean
from nacre.io.files import PathLike
from nacre.io.source import TERMS

_FOLDER = Path(__file__).parent
_ENDING = ".safetensors"
_NAME = re.compile(r"([a-z][a-z-]+):([\w.+-]*)")  # a single letter would be a Windows drive


@dataclass(frozen=True)
class Family:
    """Materials from one source under one license."""

    name: str  # before the colon
    about: str
    source: str  # whose work they are
    terms: str

    @property
    def folder(self) -> Path:
        return _FOLDER / self.name


@dataclass(frozen=True)
class Material:
    """A material that comes with nacre.

    Parameters
    ----------
    name
        Name for commands and :func:`nacre.load`: "rgl:paper_white".
    title
        Name in its file: "White A4 paper (160 gsm)".
    kind
        "brdf", or "btf" for an encoded texture.
    path, family
        Its file, and its source and terms.
    psnr
        In dB, against the measurement: for spheres in an "environment" and in "directional" light
        (:mod:`nacre.mitsuba.sphere`), for a texture over "all pairs" of directions; empty if the
        measurement may not be distributed and so was not compared.
    rounding
        PSNR in dB of spheres between a published network in half precision and the original; None
        for other materials.
    """

    name: str
    title: str
    kind: Literal["brdf", "btf"]
    path: Path
    family: Family
    psnr: Mapping[str, float]
    rounding: float | None = None

    @property
    def nbytes(self) -> int:
        """Bytes of its file."""
        return self.path.stat().st_size


@cache
def families() -> Mapping[str, Family]:
    """The families by name."""
    found = {}
    for path in sorted(_FOLDER.glob(f"*/*{TERMS}")):
        name = path.parent.name
        found[name] = Family(name, *path.read_text(encoding="utf-8").splitlines())
    return found


def materials(*words: str) -> list[Material]:
    """The materials that come with nacre, by name.

    Parameters
    ----------
    words
        Words that a name or title must contain, in any case; without words, all materials.

    Examples
    --------
    >>> import nacre
    >>> [material.name for material in nacre.materials("rgl:paper_white")]
    ['nbrdf-rgl:paper_white', 'rgl:paper_white']
    >>> nacre.load("rgl:paper_white").name
    'White A4 paper (160 gsm)'
    """
    known = (_described(name) for name in names())
    wanted = [word.lower() for word in words]
    return [m for m in known if all(word in f"{m.name} {m.title}".lower() for word in wanted)]


@cache
def names() -> tuple[str, ...]:
    """The names of all materials, in order."""
    files = ((f.name, path.stem) for f in families().values() for path in _files(f))
    return tuple(f"{family}:{stem}" for family, stem in files)


def resolve(path: PathLike) -> Path:
    """The file of an included material; other paths, and existing files, stay as they are.

    A FormatError with similar names is raised if it looks like a name but is not one.
    """
    text = os.fspath(path)
    match = _NAME.fullmatch(text)
    if match is None or os.path.lexists(text):
        return Path(path)
    if text in names():
        return families()[match[1]].folder / f"{match[2]}{_ENDING}"
    same = [name for name in names() if match[2] and name.partition(":")[2] == match[2]]
    hint = did_you_mean(text, same or names(), "'nacre materials' lists them")
    raise FormatError(f"{text}: is neither a file nor a material that comes with nacre{hint}")


def _files(family: Family) -> list[Path]:
    return sorted(family.folder.glob(f"*{_ENDING}"))


@cache
def _described(name: str) -> Material:
    """A material with the facts from the header of its file."""
    path = resolve(name)
    with safetensors.safe_open(path, "numpy") as file:
        ((key, text),) = file.metadata().items()
    header = json.loads(text)
    quality = header.get("quality", {})
    psnr = {
        light: quality[f"{light}_psnr"]
        for light in ("environment", "directional")
        if f"{light}_psnr" in quality
    }
    is_texture = key != "nacre"
    if is_texture:
        psnr = {"all pairs": round(header["metadata"]["errors"]["PSNR"], 1)}
    family = families()[name.partition(":")[0]]
    kind: Literal["brdf", "btf"] = "btf" if is_texture else "brdf"
    rounding = quality.get("rounding_psnr")
    return Material(name, header["name"], kind, path, family, psnr, rounding)
