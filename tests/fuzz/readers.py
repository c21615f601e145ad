"""Readers of files that are no materials: scenes, light, pictures, states, manifests, bases, ...

They are fuzzed as formats are: :data:`READERS` has an entry for each, with whole files to begin
with and damage that bytes alone would hardly find. Whatever is wrong with a file, a reader raises a
:class:`nacre.NacreError` of one line, or goes on without what it could not read.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

from tests.specimens.specimen import Specimen

MODULES = "light", "pictures", "kept", "codes", "lists"
"""Modules of :mod:`tests.fuzz.families`, each with its `READERS`."""


@dataclass(frozen=True)
class Reader:
    """A function that reads one file.

    Parameters
    ----------
    name
        What it reads, for people.
    specimen
        Whole files of it.
    read
        Reads the file at a path and uses what comes of it.
    writes
        Whether it may write beside the file, as long work does that goes on from it.
    """

    name: str
    specimen: Specimen
    read: Callable[[Path], object]
    writes: bool = False

    @property
    def extensions(self) -> tuple[str, ...]:
        """Ending of the file."""
        return (Path(self.specimen.name).suffix,)


def reader(
    name: str,
    file: str,
    files: Callable[[], list[bytes]],
    rebuild: Callable[[bytes, Random], bytes],
    read: Callable[[Path], object],
    *,
    companions: Mapping[str, bytes] | None = None,
    memory: int = 16 << 20,
    writes: bool = False,
) -> Reader:
    """An entry; `files` is called once, when it is first asked for."""

    def none(_: float) -> Iterable[bytes]:
        return []

    specimen = Specimen(
        file, cache(files), 0, none, none, rebuild, companions=companions or {}, memory=memory
    )
    return Reader(name, specimen, read, writes)


@cache
def readers() -> Mapping[str, Reader]:
    """All of them by name."""
    modules = (importlib.import_module(f"tests.fuzz.families.{name}") for name in MODULES)
    found: tuple[Any, ...] = sum((module.READERS for module in modules), ())
    return {entry.name: entry for entry in found}
