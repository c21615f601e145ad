"""What is kept between runs: it is found, and only it is removed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from nacre.cli.cache import NAMES
from nacre.compile.code_folder import code_folder
from nacre.io.files import digest
from nacre.workflows.caches import caches


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder in which everything is kept."""
    for name in ("NUMBA_CACHE_DIR", "NACRE_CACHE", "DRJIT_CACHE_DIR"):
        monkeypatch.setenv(name, str(tmp_path / "kept"))
    return tmp_path / "kept"


def put(path: Path, content: str = "data") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content)
    return path


def download(home: Path, name: str) -> Path:
    path = put(home / "rgl" / name)
    put(path.with_name(f"{name}.json"), json.dumps({"sha256": digest(path)}))
    return path


def test_names_on_the_command_line_are_those_of_the_caches() -> None:
    assert tuple(caches()) == NAMES


def test_nothing_is_kept_at_first(home: Path) -> None:
    for cache in caches().values():
        assert cache.size() == cache.clear() == (0, 0)
    assert not home.exists()


def test_compiled_code_is_found_where_it_is_kept(home: Path) -> None:
    put(code_folder("kernel", []) / "a.nbi")
    put(home / "other" / "a.nbi")
    put(home / "kernel-of-mine" / "a.nbi")
    assert caches()["code"].clear() == (1, 4)
    assert sorted(path.name for path in home.iterdir()) == ["kernel-of-mine", "other"]


def test_only_kernels_of_drjit_go(home: Path) -> None:
    put(home / f"{'0a' * 16}.llvm.v6.bin")
    put(home / "notes.bin")
    assert caches()["kernels"].clear() == (1, 4)
    assert [path.name for path in home.iterdir()] == ["notes.bin"]


def test_measurements_that_a_person_put_there_or_changed_stay(home: Path) -> None:
    mine = put(home / "rgl" / "mine.bsdf")
    changed = download(home, "changed.bsdf")
    changed.write_text("edited")
    download(home, "kept.bsdf")
    terms = put(home / "rgl" / "rgl-TERMS.txt")
    assert caches()["downloads"].clear()[0] == 2
    left = {mine, changed, changed.with_name("changed.bsdf.json"), terms}
    assert set((home / "rgl").iterdir()) == left
