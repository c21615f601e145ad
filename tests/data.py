"""The one way in which tests and benchmarks reach real measurements."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

_REPOSITORY = Path(__file__).resolve().parents[1]


def data_folder() -> Path | None:
    """Folder of real measurements: `NACRE_DATA`, else `../shared/data` beside the checkout."""
    named = os.environ.get("NACRE_DATA")
    folder = Path(named) if named else _REPOSITORY.parent / "shared" / "data"
    return folder if folder.is_dir() else None


def require_data(*parts: str) -> Path:
    """Path of a real measurement; skips the calling test where it is absent."""
    folder = data_folder()
    if folder is None:
        pytest.skip("no real measurements: set NACRE_DATA to the folder that holds them")
    path = folder.joinpath(*parts)
    if not path.exists():
        pytest.skip(f"{'/'.join(parts)} is not among the real measurements")
    return path


def list_data(folder: str, pattern: str) -> list[str]:
    """Names of the files in a folder of real measurements; empty where it is absent."""
    root = data_folder()
    return sorted(p.name for p in (root / folder).glob(pattern)) if root else []
