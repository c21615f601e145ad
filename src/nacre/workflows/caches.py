"""What is kept on this machine between runs: where it lies, how large it is, how it is emptied."""

from __future__ import annotations

import os
import re
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from nacre.compile.code_folder import code_root
from nacre.download.databases import databases
from nacre.download.fetch import cache_folder, downloaded
from nacre.errors import NacreError

_CODE = re.compile(r"(formulas|kernel)-[0-9a-f]{16}")
_KERNEL = re.compile(r"[0-9a-f]{32}\.[a-z]+\.v\d+\.bin")


@dataclass(frozen=True)
class Cache:
    """One kind of files that are kept.

    Parameters
    ----------
    name
        What people call it on the command line.
    about
        What it holds, and what happens when it is emptied.
    folder
        Where it lies; need not exist.
    remade
        Whether everything in it is made again when it is needed, without a network.
    entries
        Finds the files and folders that belong to it: what others keep in the folder is no part.
    """

    name: str
    about: str
    folder: Path
    remade: bool
    entries: Callable[[Path], Iterator[Path]]

    def files(self) -> list[Path]:
        """All files of the cache."""
        found: list[Path] = []
        for entry in self.entries(self.folder):
            inside = [p for p in entry.rglob("*") if p.is_file()] if entry.is_dir() else [entry]
            found.extend(inside)
        return found

    def size(self) -> tuple[int, int]:
        """How many files there are, and their bytes."""
        count = total = 0
        for path in self.files():
            with suppress(OSError):  # another process may have removed it
                total += path.stat().st_size
                count += 1
        return count, total

    def clear(self) -> tuple[int, int]:
        """Remove all entries; how many files went, and their bytes.

        Raises NacreError where a file cannot be removed.
        """
        before = self.size()
        try:
            for entry in list(self.entries(self.folder)):
                if entry.is_dir() and not entry.is_symlink():
                    shutil.rmtree(entry)
                else:
                    entry.unlink(missing_ok=True)
        except OSError as error:
            raise NacreError(f"{error.filename}: cannot be removed: {error.strerror}") from error
        after = self.size()
        return before[0] - after[0], before[1] - after[1]


def caches() -> dict[str, Cache]:
    """Everything that is kept, by name."""
    every = (
        Cache("code", "compiled code of fits and formulas", code_root(), True, _matching(_CODE)),
        Cache(
            "kernels",
            "Dr.Jit's compiled kernels, which other programs with Dr.Jit use too",
            _drjit_folder(),
            True,
            _matching(_KERNEL),
        ),
        Cache(
            "downloads",
            "measurements from public databases, as they were downloaded",
            cache_folder(),
            False,
            _downloads,
        ),
    )
    return {cache.name: cache for cache in every}


def _matching(pattern: re.Pattern[str]) -> Callable[[Path], Iterator[Path]]:
    """Finds what lies in a folder under names that a pattern matches."""

    def found(folder: Path) -> Iterator[Path]:
        if folder.is_dir():
            yield from (path for path in folder.iterdir() if pattern.fullmatch(path.name))

    return found


def _downloads(folder: Path) -> Iterator[Path]:
    """Files that nacre downloaded, each with its record; what a person put there is left."""
    for database in databases():
        yield from downloaded(folder / database)


def _drjit_folder() -> Path:
    """Where Dr.Jit keeps kernels."""
    if named := os.environ.get("DRJIT_CACHE_DIR"):
        return Path(named)
    if sys.platform == "win32":
        return Path(tempfile.gettempdir()) / "drjit"
    return Path.home() / ".drjit"
