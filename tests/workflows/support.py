"""Small materials and quick fits."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import nacre
from nacre.io.outputs import overwrite
from nacre.measured.merl import Resolution
from nacre.measured.merl import save as save_merl
from nacre.workflows import MANIFEST, NetworkFitting
from tests.scans import Gloss

RECIPE = nacre.Recipe(hidden=(4,), epochs=1, samples=1000)
QUICK = NetworkFitting(RECIPE)


@dataclass(frozen=True)
class Staged(NetworkFitting):
    """A quick fit before which something happens to the material."""

    recipe: nacre.Recipe = RECIPE
    before: Callable[[nacre.Brdf, Any], None] = field(default=lambda brdf, progress: None)

    def fit(self, brdf: nacre.Brdf, progress: Any) -> Any:
        self.before(brdf, progress)
        return super().fit(brdf, progress)


def table(path: Path, theta_h: int = 6) -> Path:
    """A MERL table of few nodes; other numbers of nodes make other files."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with overwrite():
        save_merl(Gloss(), path, Resolution(theta_h, 4, 4))
    return path


def contents(folder: Path) -> dict[str, bytes]:
    """Every file in a folder by its relative path, hidden ones too."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def lines(output: Path) -> list[dict[str, Any]]:
    """The manifest as it is on disk."""
    return [json.loads(line) for line in (output / MANIFEST).read_text().splitlines()]


def sources(records: Any) -> set[str]:
    return {record.source for record in records}


def eventually(look: Callable[[], Any], seconds: float = 180.0) -> Any:
    """What `look` returns as soon as that is true."""
    end = time.monotonic() + seconds
    while not (found := look()):
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)
    return found
