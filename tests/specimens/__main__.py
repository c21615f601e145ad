"""Write the files of every format into a folder, for an installation elsewhere to read.

`python -m tests.specimens FOLDER` makes a folder for each file, and `index.json`: a list of objects
with the name of the format, the path of the file in FOLDER, and the library that reading it needs.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

from tests.specimens import SPECIMENS

_UTIA_NAMES = "tl000_pl000_tv000_pv000.png", "tl030_pl060_tv000_pv000.png"


def entries() -> Iterator[tuple[str, str, str, Mapping[str, bytes]]]:
    """A format, the name of what to read, the library for it, and contents of files by name."""
    for name, specimen in SPECIMENS.items():
        for content in specimen.files():
            files = {specimen.name: content, **specimen.companions}
            yield name, specimen.name, specimen.module, files
    pictures = SPECIMENS["photographs"].companions.values()
    yield "UTIA BTF folder", "", "mitsuba", dict(zip(_UTIA_NAMES, pictures, strict=True))


def write(folder: Path) -> None:
    """Write all files into a new folder."""
    index = []
    for number, (format_name, file_name, library, files) in enumerate(entries()):
        place = folder / f"{number:02}"
        place.mkdir(parents=True)
        for name, content in files.items():
            (place / name).write_bytes(content)
        path = f"{place.name}/{file_name}".rstrip("/")
        index.append({"format": format_name, "path": path, "needs": library})
    (folder / "index.json").write_text(json.dumps(index, indent=1), encoding="utf-8")


if __name__ == "__main__":
    write(Path(sys.argv[1]))
