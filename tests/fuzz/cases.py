"""Everything there is to fuzz: the formats of the registry, and the other readers."""

from __future__ import annotations

from collections.abc import Mapping

from nacre.io.format import Format
from tests.fuzz.readers import Reader, readers
from tests.specimens import SPECIMENS, Specimen, file_formats


def cases() -> Mapping[str, tuple[Format | Reader, Specimen]]:
    """What reads, and its specimen, by name."""
    formats = {entry.name: (entry, SPECIMENS[entry.name]) for entry in file_formats()}
    return formats | {name: (entry, entry.specimen) for name, entry in readers().items()}
