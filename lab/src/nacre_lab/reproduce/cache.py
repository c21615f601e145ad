"""Results cached in a folder, so that a stopped experiment can resume.

A result is named by its kind and a fingerprint of everything that determines it: the contents of
the material's file, the method and its settings, the protocol, and the code involved.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

import nacre
import nacre_lab
from nacre.errors import NacreError
from nacre.io.files import atomic_path
from nacre.runtime.code_fingerprint import code_fingerprint, code_text

SOURCES = tuple(Path(package.__path__[0]) for package in (nacre, nacre_lab))
"""Folders of the modules that determine results."""
"""The folder of nacre's modules."""
_DECIDING = ("codes", "extracted", "methods", "noise", "samplers", "texture_network", "trial")
"""Modules of experiments that determine the result of a trial, with all that they import."""

Arrays = Mapping[str, Any]
_Kept = TypeVar("_Kept")


class Cache:
    """Results in a folder, which is made for the first one.

    If `fresh`, results from other runs are ignored.
    """

    def __init__(self, folder: Path, *, fresh: bool = False) -> None:
        self.folder, self.fresh = folder, fresh
        self._made: set[Path] = set()

    def path(self, key: str, ending: str = ".npz") -> Path:
        """The file of a result."""
        return self.folder / f"{key}{ending}"

    def find(self, key: str, names: Sequence[str]) -> dict[str, Any] | None:
        """Cached arrays; None if there are none, or the file is damaged."""
        path = self.path(key)
        if self._absent(path):
            return None
        try:
            with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
                return {name: arrays[name] for name in names}
        except Exception:  # damage raises many errors in zipfile and NumPy
            return None

    def keep(self, key: str, arrays: Arrays) -> None:
        """Write arrays completely or not at all."""
        self.folder.mkdir(parents=True, exist_ok=True)
        with atomic_path(self.path(key), internal=True) as temporary:
            np.savez_compressed(temporary, **arrays)
        self._made.add(self.path(key))

    def arrays(self, key: str, names: Sequence[str], make: Callable[[], Arrays]) -> Arrays:
        """Cached arrays, or new ones, which are cached."""
        found = self.find(key, names)
        if found is None:
            found = dict(make())
            self.keep(key, found)
        return found

    def file(
        self,
        key: str,
        load: Callable[[Path], _Kept],
        make: Callable[[Path], _Kept],
        save: Callable[[_Kept, Path], object],
    ) -> _Kept:
        """The content of a `.safetensors` file, made and saved if necessary.

        Parameters
        ----------
        key
            Of the file.
        load, save
            Read and write it.
        make
            Called with a prefix for files with the state of stopped work, to resume from. These
            files are removed once the result is saved.
        """
        path = self.path(key, ".safetensors")
        if not self._absent(path):
            with suppress(NacreError):  # damaged
                return load(path)
        path.unlink(missing_ok=True)
        self.folder.mkdir(parents=True, exist_ok=True)
        state = path.with_suffix(".state")
        if self.fresh:
            self._remove(state)
        found = make(state)
        save(found, path)
        self._made.add(path)
        self._remove(state)
        return found

    def _absent(self, path: Path) -> bool:
        return not path.is_file() or (self.fresh and path not in self._made)

    def _remove(self, state: Path) -> None:
        for path in self.folder.glob(f"{state.name}*"):
            path.unlink()


def cache_key(kind: str, facts: object) -> str:
    """The key of a result: its kind, and half of the SHA-256 of JSON-able facts."""
    return f"{kind}-{hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()[:32]}"


def code_digest() -> str:
    """Fingerprint of the code that determines the result of a trial."""
    return code_fingerprint(
        *(f"nacre_lab.reproduce.{name}" for name in _DECIDING), within=("nacre",)
    )


def module_digest(*patterns: str) -> str:
    """SHA-256 of the code in the modules that match some patterns of paths.

    Raises
    ------
    ValueError
        If a pattern matches no module: one was moved, and its code would not count.
    """
    found: set[tuple[Path, Path]] = set()
    for pattern in patterns:
        modules = {(path, folder) for folder in SOURCES for path in folder.glob(pattern)}
        if not modules:
            raise ValueError(f"no module is called {pattern}")
        found |= modules
    total = hashlib.sha256()
    for path, folder in sorted(found):
        total.update(f"{path.relative_to(folder).as_posix()}\0{code_text(path)}\0".encode())
    return total.hexdigest()
