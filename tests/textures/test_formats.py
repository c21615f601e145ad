"""The registry of textures, and what the registry of materials says of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre import textures
from nacre.btf import TableBtf
from nacre.formats import formats
from nacre.textures.formats import FORMATS, is_btf, recognized
from tests.specimens import SPECIMENS
from tests.textures.support import assert_refused


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    up = np.array([[0.0, 0.0, 1.0]], np.float32)
    textures.save(TableBtf(np.ones((2, 3, 1, 3), np.float16), up, up), tmp_path / "x.npz")
    return tmp_path / "x.npz"


def test_content_decides_not_the_name(archive: Path) -> None:
    other = archive.rename(archive.with_suffix(".dat"))
    assert recognized(other).name == "NumPy archive of a BTF"
    assert textures.load(other).pair_count == 1


def test_textures_are_no_materials(archive: Path) -> None:
    assert is_btf(archive)
    assert_refused(lambda: nacre.load(archive), str(archive), "see nacre btf info")
    folder = archive.parent
    assert not is_btf(folder)
    (folder / "tv000_pv000").mkdir()
    assert is_btf(folder)
    assert_refused(lambda: nacre.load(folder), str(folder), "see nacre btf info")
    assert not is_btf(folder / "absent")


def test_materials_are_no_textures(tmp_path: Path) -> None:
    names = {entry.name for entry in formats()}
    for name, specimen in SPECIMENS.items():
        path = tmp_path / f"of-{specimen.name}"
        path.write_bytes(specimen.files()[0])
        if name in names:
            assert not is_btf(path)
            assert_refused(lambda path=path: textures.load(path), str(path))


def test_what_is_no_texture_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.txt"
    assert_refused(lambda: textures.load(path), str(path), "cannot be read")
    path.write_bytes(b"")
    assert_refused(lambda: textures.load(path), str(path), "is empty")
    path.write_bytes(b"text")
    assert_refused(lambda: textures.load(path), str(path), "is no texture of a known format")
    path.unlink()
    path.symlink_to(path)
    assert_refused(lambda: textures.load(path), str(path), "cannot be read")


def test_what_cannot_be_written_is_refused(archive: Path) -> None:
    found = textures.load(archive)
    for name in ("x", "x.csv", "x.png"):
        assert_refused(lambda name=name: textures.save(found, name), name, "known: ", ".npz")
    assert_refused(lambda: textures.load(archive, "radiance"), "state nothing")


def test_every_format_is_told_apart() -> None:
    assert len({entry.name for entry in (*formats(), *FORMATS)}) == len(formats()) + len(FORMATS)
