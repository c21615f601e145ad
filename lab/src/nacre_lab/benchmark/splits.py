"""Splits of the benchmark: which materials are judged, and which ones codes may learn from."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path

from nacre.download.databases import databases
from nacre.errors import NacreError
from nacre.included import resolve
from nacre.io.files import digest


@dataclass(frozen=True)
class Split:
    """Materials that never change.

    Parameters
    ----------
    name, about
        What it is called, and what is in it.
    materials
        What methods are judged on: names of materials that come with nacre, or of the database.
    training
        What bases of codes are trained on; none of the above.
    database
        Whose measured files the materials without a colon in their names are; see
        :func:`nacre.download.databases.databases`. None where all come with nacre.
    """

    name: str
    about: str
    materials: tuple[str, ...]
    training: tuple[str, ...]
    database: str | None = None

    def path(self, material: str, folder: Path | None = None) -> Path:
        """The file of a material, which is the one that everybody else has.

        Parameters
        ----------
        material
            One of :attr:`materials` or :attr:`training`.
        folder
            Where the files of the database are.

        Raises
        ------
        NacreError
            If no folder is given and one is needed, the file is not in it, or it is another one.
        """
        if ":" in material or self.database is None:
            return resolve(material)
        database = databases()[self.database]
        file = database.file_name(material)
        get = f"'nacre download {self.database} {material}' fetches it"
        if folder is None:
            raise NacreError(f"{self.name}: needs {file}; {get}, --measured names its folder")
        path = folder / file
        if not path.is_file():
            raise NacreError(f"{folder}: has no {file}; {get}")
        expected = database.facts(material).sha256
        if expected is not None and digest(path) != expected:
            raise NacreError(f"{path}: is not the file that the benchmark is of; {get}")
        return path

    def chosen(self, only: Sequence[str]) -> tuple[str, ...]:
        """Some of the materials in their order; all where none are named.

        Raises
        ------
        NacreError
            If a name is none of them.
        """
        for name in only:
            if name not in self.materials:
                known = ", ".join(self.materials)
                raise NacreError(f"{name!r} is no material of the split {self.name} ({known})")
        return tuple(name for name in self.materials if not only or name in only)


@cache
def splits() -> Mapping[str, Split]:
    """All splits by name."""
    text = (resources.files(__package__) / "splits.json").read_text(encoding="utf-8")
    return {
        name: Split(
            name,
            entry["about"],
            tuple(entry["materials"]),
            tuple(entry["training"]),
            entry.get("database"),
        )
        for name, entry in json.loads(text).items()
    }


def find_split(name: str) -> Split:
    """The split of a name.

    Raises
    ------
    NacreError
        If there is none; the message lists them.
    """
    if name not in splits():
        raise NacreError(f"{name!r} is no split (known: {', '.join(splits())})")
    return splits()[name]
