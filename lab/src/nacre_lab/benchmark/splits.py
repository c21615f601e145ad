"""Splits of the benchmark: materials to test on, and materials that codes may learn from."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path

from nacre.download.databases import databases
from nacre.errors import NacreError
from nacre.formats import load_brdf
from nacre.included import resolve
from nacre.io.files import digest
from nacre.workflows.sources import find_sources, output_names


@dataclass(frozen=True)
class Split:
    """Materials to judge methods by: those of a split never change, those in files are the user's.

    Parameters
    ----------
    name, about
        Its name and content.
    materials
        Materials to test methods on: names of materials that come with nacre, or in the database.
    training
        Materials to train bases of codes on; none of the above.
    database
        Whose measured files the materials without a colon in their names are; see
        :func:`nacre.download.databases.databases`. None if all come with nacre.
    files
        The user's files by name of material; None for a split.
    """

    name: str
    about: str
    materials: tuple[str, ...]
    training: tuple[str, ...]
    database: str | None = None
    files: Mapping[str, Path] | None = None

    def path(self, material: str, folder: Path | None = None) -> Path:
        """The file of a material, checked to be the same for everybody.

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
        if self.files is not None:
            return self.files[material]
        if ":" in material or self.database is None:
            return resolve(material)
        database = databases()[self.database]
        file = database.file_name(material)
        get = f"'nacre download {self.database} {material}' fetches it"
        if folder is None:
            raise NacreError(f"{self.name}: needs {file}; {get}, and --measured names its folder")
        path = folder / file
        if not path.is_file():
            raise NacreError(f"{folder}: has no {file}; {get}")
        expected = database.facts(material).sha256
        if expected is not None and digest(path) != expected:
            raise NacreError(f"{path}: is not the file that the benchmark uses; {get}")
        return path

    def chosen(self, only: Sequence[str]) -> tuple[str, ...]:
        """The named materials in their order, or all.

        Raises
        ------
        NacreError
            If a name is none of them.
        """
        for name in only:
            if name not in self.materials:
                known = ", ".join(self.materials)
                where = "the files" if self.files is not None else f"the split {self.name}"
                raise NacreError(f"{name!r} is not a material of {where} ({known})")
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
        raise NacreError(f"{name!r} is not a split (known: {', '.join(splits())})")
    return splits()[name]


def given(
    paths: Sequence[Path], output: Path, left_out: Callable[[Path], None] = lambda path: None
) -> Split:
    """The materials in files, and in the measured files of folders, which are the user's own.

    There are no materials to train bases of codes on.

    Parameters
    ----------
    paths
        Folders and files; see :func:`nacre.workflows.find_sources`.
    output
        The results file, which is none of them.
    left_out
        Called with every file in a folder that has the ending of a measurement but is not one.

    Raises
    ------
    NacreError
        If there is none, or a file cannot be read as a reflectance, before any work.
    """
    sources = find_sources(paths, output, left_out)
    if not sources:
        raise NacreError(f"{', '.join(map(str, paths))}: no measured materials found")
    files = {
        name: source.path for name, source in zip(output_names(sources, ""), sources, strict=True)
    }
    for path in files.values():
        load_brdf(path)
    folders = dict.fromkeys(
        (path if path.is_dir() else path.parent).resolve().name for path in paths
    )
    return Split(
        f"files in {', '.join(folders)}", "the user's files", tuple(files), (), files=files
    )
