"""Results in a folder, so that an experiment that was stopped goes on where it was.

What is kept is named by its kind and a fingerprint of all that decides it: the contents of the
material's file, the method and its settings, the protocol, and the code of nacre that matters.
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
"""Folders of the modules that decide results."""
"""Where nacre's modules are."""
_DECIDING = ("codes", "extracted", "methods", "noise", "samplers", "texture_network", "trial")
"""Modules of experiments that decide what a trial finds, by all that they reach."""

Arrays = Mapping[str, Any]
_Kept = TypeVar("_Kept")


class Cache:
    """Results in a folder, which is made when the first one is kept.

    Where `fresh`, what other runs kept counts as absent.
    """

    def __init__(self, folder: Path, *, fresh: bool = False) -> None:
        self.folder, self.fresh = folder, fresh
        self._made: set[Path] = set()

    def path(self, key: str, ending: str = ".npz") -> Path:
        """The file of a result."""
        return self.folder / f"{key}{ending}"

    def find(self, key: str, names: Sequence[str]) -> dict[str, Any] | None:
        """Arrays that were kept; None where there are none, or a damaged file."""
        path = self.path(key)
        if self._absent(path):
            return None
        try:
            with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
                return {name: arrays[name] for name in names}
        except Exception:  # zipfile and NumPy meet damage in many ways
            return None

    def keep(self, key: str, arrays: Arrays) -> None:
        """Write arrays, whole or not at all."""
        self.folder.mkdir(parents=True, exist_ok=True)
        with atomic_path(self.path(key), internal=True) as temporary:
            np.savez_compressed(temporary, **arrays)
        self._made.add(self.path(key))

    def arrays(self, key: str, names: Sequence[str], make: Callable[[], Arrays]) -> Arrays:
        """Arrays that were kept, or that are made and kept now."""
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
        """What is in a `.safetensors` file, or is made and saved now.

        Parameters
        ----------
        key
            Of the file.
        load, save
            Read and write it.
        make
            Given what names of files start with for the state of work that is stopped, from which
            it goes on. These files are removed once the result is saved.
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
    """Fingerprint of the code that decides what a trial finds."""
    return code_fingerprint(
        *(f"nacre_lab.reproduce.{name}" for name in _DECIDING), within=("nacre",)
    )


def module_digest(*patterns: str) -> str:
    """SHA-256 of the code of the modules that some patterns of paths name.

    Raises
    ------
    ValueError
        If a pattern names no module: one was moved, and results would be kept without it.
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
