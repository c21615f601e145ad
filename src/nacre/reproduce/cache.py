"""Finished trials in a folder, so that an experiment that was stopped goes on where it was.

A trial is up to three files under one key: the figures as JSON, written last; the pictures as
`.npz`; and the representation, where nacre has a format for it. The key is a SHA-256 of the
material's file, its name, the method and its settings, the protocol, and nacre's own code.
"""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Iterable
from dataclasses import asdict
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import nacre
from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.formats import load_brdf, save
from nacre.io.files import atomic_path
from nacre.reproduce.methods import TRUTH, Method
from nacre.reproduce.trial import FIGURES, LIGHTS, Picture, Settings, Trial

DAMAGED = (OSError, ValueError, TypeError, KeyError, EOFError, zipfile.BadZipFile)
"""What reading a file that is not there or not whole raises."""
SOURCES = Path(nacre.__file__).parent
"""Where nacre's modules are."""
_ENDINGS = {"NeuralBrdf": ".safetensors", "AnalyticBrdf": ".json", "RglBrdf": ".bsdf"}
"""Of files that hold a class of reflectance exactly."""
_IGNORED = ("cli", "download", "reproduce")
"""Parts of nacre that do not change what a trial finds; within the last, see `_COUNTED`."""
_COUNTED = [
    SOURCES / "reproduce" / name for name in ("codes.py", "methods.py", "noise.py", "trial.py")
]


class Cache:
    """Trials in a folder, which is made when the first one is kept.

    Parameters
    ----------
    folder
        Where they are.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def find(self, key: str) -> Trial | None:
        """A finished trial; None where there is none, or where its files are damaged."""
        try:
            content = json.loads(self._path(key, ".json").read_text(encoding="utf-8"))
            trial = Trial(**content)
            whole = set(trial.figures) == set(FIGURES) and all(self.pictures(key))
            return trial if whole else None
        except DAMAGED:
            return None

    def pictures(self, key: str) -> dict[str, Picture]:
        """The pictures of a finished trial by the name of their light."""
        path = self._path(key, ".npz")
        with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
            return {
                light: Picture(*(arrays[f"{light} {part}"] for part in Picture.__annotations__))
                for light in LIGHTS
            }

    def fitted(self, key: str) -> Brdf | None:
        """The representation of a finished trial, where it was kept."""
        for ending in _ENDINGS.values():
            path = self._path(key, f".fitted{ending}")
            if path.is_file():
                try:
                    return load_brdf(path)
                except NacreError:
                    return None
        return None

    def keep(self, key: str, trial: Trial, pictures: dict[str, Picture], fitted: Brdf) -> None:
        """Write a trial, each file whole or not at all, the one that says it is finished last.

        Raises
        ------
        FormatError
            If the folder cannot be written.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        kinds = [kind.__name__ for kind in type(fitted).__mro__]
        endings = [ending for kind, ending in _ENDINGS.items() if kind in kinds]
        if endings and trial.method != TRUTH:  # the material itself need not be kept
            save(fitted, self._path(key, f".fitted{endings[0]}"))
        arrays = {f"{n} {part}": a for n, p in pictures.items() for part, a in asdict(p).items()}
        with atomic_path(self._path(key, ".npz"), internal=True) as temporary:
            np.savez_compressed(temporary, **arrays)
        with atomic_path(self._path(key, ".json"), internal=True) as temporary:
            temporary.write_text(json.dumps(asdict(trial)), encoding="utf-8")

    def _path(self, key: str, ending: str) -> Path:
        return self.folder / f"{key}{ending}"


def key(material: str, sha256: str, name: str, method: Method, settings: Settings) -> str:
    """Under what a trial is kept: all that matters for it.

    Parameters
    ----------
    material
        Its name, by which published networks are found.
    sha256
        Of its file.
    name, method
        How it is represented.
    settings
        Of the trials.
    """
    facts: dict[str, Any] = {
        "material": [material, sha256],
        "method": name,
        "settings": dict(method.settings),
        "protocol": settings.facts,
        "code": code_digest(),
    }
    return facts_digest(facts)


def facts_digest(facts: object) -> str:
    """32 hexadecimal digits of the SHA-256 of JSON-able facts, which results are kept under."""
    return hashlib.sha256(json.dumps(facts, sort_keys=True).encode()).hexdigest()[:32]


@cache
def code_digest() -> str:
    """SHA-256 of nacre's version and of its modules that matter for a trial."""
    counted = []
    for path in SOURCES.rglob("*.py"):
        folder = path.relative_to(SOURCES).parts[0]
        if folder not in _IGNORED or path in _COUNTED:
            counted.append(path)
    return sources_digest(counted)


def sources_digest(paths: Iterable[Path]) -> str:
    """SHA-256 of nacre's version and of some of its modules."""
    total = hashlib.sha256(nacre.__version__.encode())
    for path in sorted(paths):
        total.update(path.relative_to(SOURCES).as_posix().encode() + path.read_bytes())
    return total.hexdigest()
