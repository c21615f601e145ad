"""Facts about the databases: names, addresses, sizes, checksums, terms of use.

The ALTA library's tutorial fetches MERL files from the authors' server; the files behind
rgl.epfl.ch/materials are on the host named here. We know no address of single UTIA files, so that
database needs a mirror.
"""

from __future__ import annotations

import fnmatch
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from urllib.parse import urlsplit

from nacre.errors import NacreError, did_you_mean


@dataclass(frozen=True)
class Facts:
    """SHA-256 in hexadecimal and length in bytes of a file, None if unknown."""

    sha256: str | None = None
    size: int | None = None


@dataclass(frozen=True)
class Database:
    """One database of measured materials."""

    name: str
    title: str  # its content in a few words
    suffix: str  # of a file's name, after the material's name
    terms: str  # terms of use in short, with a link
    page: str  # where people find the files
    materials: Mapping[str, Facts] = field(default_factory=dict)  # empty: any plain name
    url: str | None = None  # of a file, with {name} for the material; None if not known
    limit: int = 2**29  # length that no file exceeds, in bytes
    size: int | None = None  # length of every file in bytes, if all are the same
    free: str = ""  # why nobody needs to accept the terms; empty if they must be accepted

    def facts(self, material: str) -> Facts:
        """Facts about the file of a material; its name is then safe as part of a path.

        A NacreError names similar materials if there is no such one.
        """
        if material in self.materials:
            return self.materials[material]
        if not self.materials and re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_-]*", material):
            return Facts(size=self.size)
        hint = did_you_mean(material, self.materials, self._where_names_are())
        raise NacreError(f"{self.name}: has no material {material!r}{hint}")

    def select(self, patterns: Sequence[str]) -> list[str]:
        """The materials that match names or patterns with `*`, `?` and `[...]`, in order.

        A NacreError is raised if a pattern matches none, or a name is unknown.
        """
        chosen: dict[str, None] = {}
        for pattern in patterns:
            if any(character in pattern for character in "*?["):
                found = fnmatch.filter(self.materials, pattern)
                if not found:
                    problem = f"no material matches {pattern!r}; {self._where_names_are()}"
                    raise NacreError(f"{self.name}: {problem}")
                chosen.update(dict.fromkeys(found))
            else:
                self.facts(pattern)
                chosen[pattern] = None
        return list(chosen)

    def file_name(self, material: str) -> str:
        self.facts(material)
        return material + self.suffix

    def address(self, material: str, mirror: str | None = None) -> str:
        """Address of the file of a material; at a mirror, it is `MIRROR/DATABASE/FILE`.

        A NacreError is raised if the material is unknown, the mirror is not a web address, or there
        is neither a mirror nor a known address.
        """
        file_name = self.file_name(material)
        if mirror is not None:
            try:
                valid = urlsplit(mirror).scheme in ("http", "https") and urlsplit(mirror).hostname
            except ValueError:
                valid = None
            if not valid:
                raise NacreError(f"mirror {mirror!r}: expected an address like https://host/folder")
            return f"{mirror.rstrip('/')}/{self.name}/{file_name}"
        if self.url is None:
            raise NacreError(
                f"{self.name}: the address of its files is not known; fetch them by hand from "
                f"{self.page}, or name a mirror (--mirror or NACRE_MIRROR) that has "
                f"{self.name}/{file_name}"
            )
        return self.url.format(name=material)

    def _where_names_are(self) -> str:
        known = f"'nacre download {self.name}' lists them"
        return known if self.materials else f"its names are at {self.page}"


@cache
def databases() -> Mapping[str, Database]:
    """All databases by name."""
    rgl = _table("rgl.txt")
    rgl_url = "https://d38rqfq1h7iukm.cloudfront.net/media/materials/{name}/{name}"
    rgl_terms, rgl_page = _text("rgl-terms.txt"), "https://rgl.epfl.ch/materials"
    rgl_free = "CC0, no conditions"  # as its terms say
    spectral = dict.fromkeys(rgl, Facts())
    kinds = (
        ("rgl", "62 materials, 11 of them anisotropic, as colors", "_rgb.bsdf", rgl),
        ("rgl-spectral", "the same 62 materials as spectra", "_spec.bsdf", spectral),
    )
    every = (
        Database(
            "merl",
            "100 isotropic materials, 35 MB each",
            ".binary",
            _text("merl-terms.txt"),
            "https://www.merl.com/brdf/",
            _table("merl.txt"),
            "http://people.csail.mit.edu/wojciech/BRDFDatabase/brdfs/{name}.binary",
        ),
        *(
            Database(
                name, title, suffix, rgl_terms, rgl_page, materials, rgl_url + suffix, free=rgl_free
            )
            for name, title, suffix, materials in kinds
        ),
        Database(
            "utia",
            "150 anisotropic materials, 2 MB each; needs a mirror",
            ".bin",
            _text("utia-terms.txt"),
            "http://btf.utia.cas.cz/?brdf_dat_dwn",
            size=288 * 288 * 3 * 8,
        ),
    )
    return {database.name: database for database in every}


def find(name: str) -> Database:
    """The database of a name; a NacreError if there is none."""
    if name not in databases():
        hint = did_you_mean(name, databases(), f"expected one of {', '.join(databases())}")
        raise NacreError(f"there is no database {name!r}{hint}")
    return databases()[name]


def _text(name: str) -> str:
    return (resources.files(__package__) / "facts" / name).read_text(encoding="utf-8")


def _table(name: str) -> dict[str, Facts]:
    """A file with lines `NAME`, or `NAME SHA256 BYTES` if these are known."""
    rows = [line.split() for line in _text(name).splitlines()]
    return {row[0]: Facts(row[1], int(row[2])) if row[1:] else Facts() for row in rows}
