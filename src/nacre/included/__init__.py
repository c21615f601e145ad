"""Materials that come with nacre: a name like `rgl:paper_white` is read as a file is.

Each family is a folder here, with a file a material and one of its terms of use, whose lines say
what the family is, where it is from and what its license is. `scripts/included.py` makes them.
"""

from __future__ import annotations

import difflib
import json
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Literal

import safetensors

from nacre.errors import FormatError
from nacre.io.files import PathLike
from nacre.io.source import TERMS

_FOLDER = Path(__file__).parent
_ENDING = ".safetensors"
_NAME = re.compile(r"([a-z][a-z-]+):([\w.+-]*)")  # a lone letter is a drive of Windows


@dataclass(frozen=True)
class Family:
    """Materials of one source and one license.

    Parameters
    ----------
    name
        What stands before the colon.
    about, source, terms
        What they are, whose work, and on which terms.
    """

    name: str
    about: str
    source: str
    terms: str

    @property
    def folder(self) -> Path:
        """Where its files are."""
        return _FOLDER / self.name


@dataclass(frozen=True)
class Material:
    """A material that comes with nacre.

    Parameters
    ----------
    name
        What commands and :func:`nacre.load` take: "rgl:paper_white".
    title
        What its file calls it: "White A4 paper (160 gsm)".
    kind
        "brdf", or "btf" for an encoded texture.
    path
        Its file.
    family
        Where it is from, and its terms.
    psnr
        In dB, against what was measured: of spheres in an "environment" and in "directional" light
        (:mod:`nacre.render.sphere`), of a texture over "all pairs" of directions; empty where the
        measurement may not be passed on and so was not compared.
    rounding
        What half precision costs a published network: the PSNR in dB of spheres to the network as
        it was published; None of any other material.
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
        Those whose name or title has all of them, whatever the case; all materials without any.

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
    """The names of all of them, in order."""
    files = ((f.name, path.stem) for f in families().values() for path in _files(f))
    return tuple(f"{family}:{stem}" for family, stem in files)


def resolve(path: PathLike) -> Path:
    """The file that a name stands for; any other path as it is, and so a file that has the name.

    Raises
    ------
    FormatError
        If it looks like a name and is none, with those most like it.
    """
    text = os.fspath(path)
    match = _NAME.fullmatch(text)
    if match is None or os.path.lexists(text):
        return Path(path)
    if text in names():
        return families()[match[1]].folder / f"{match[2]}{_ENDING}"
    same = [name for name in names() if match[2] and name.partition(":")[2] == match[2]]
    near = [*same, *difflib.get_close_matches(text, names(), 3)]
    what = " or ".join(list(dict.fromkeys(near))[:3])
    hint = f"did you mean {what}?" if near else "'nacre materials' lists those that there are"
    raise FormatError(f"{text}: is neither a file nor a material that comes with nacre; {hint}")


def _files(family: Family) -> list[Path]:
    return sorted(family.folder.glob(f"*{_ENDING}"))


@cache
def _described(name: str) -> Material:
    """A material with what the header of its file says."""
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
