"""Damaged results in the cache are made anew, and never end a command."""

from __future__ import annotations

import io
from pathlib import Path
from random import Random

import numpy as np
import pytest

from nacre_lab.reproduce.cache import Cache
from tests.specimens.specimen import mutated


def _archive() -> bytes:
    stream = io.BytesIO()
    np.savez_compressed(stream, a=np.arange(60.0).reshape(4, 15), b=np.array("{}"))
    return stream.getvalue()


@pytest.mark.parametrize("seed", range(200))
def test_damage_is_found_or_harmless(tmp_path: Path, seed: int) -> None:
    path = tmp_path / "a.npz"
    path.write_bytes(mutated(_archive(), Random(seed)))
    found = Cache(tmp_path).find("a", ["a", "b"])
    assert found is None or set(found) == {"a", "b"}
