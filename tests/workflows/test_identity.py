"""Fingerprints of sources: the same for the same files, others once a file is another."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

from nacre.errors import FormatError
from nacre.formats import load_btf
from nacre.workflows.identity import source_files, source_fingerprint
from tests.textures.codecs.networks.made import texture
from tests.textures.made import write
from tests.textures.support import pixels, write_image

pytest.importorskip("mitsuba", reason="needs the extra 'render'")

LIST = "file,theta_l,phi_l,theta_v,phi_v\na.png,0,0,45,180\nmore/b.png,60,30,12,270\n"
NAMES = "tl000_pl000_tv045_pv180.png", "tl060_pl030_tv012_pv270.png"


@pytest.fixture
def photographs(tmp_path: Path) -> Path:
    folder = tmp_path / "felt"
    for seed, name in enumerate(("a.png", "more/b.png")):
        write_image(folder / name, pixels(seed))
    (folder / "directions.csv").write_text(LIST)
    return folder


@pytest.fixture
def utia(tmp_path: Path) -> Path:
    folder = tmp_path / "wood"
    for seed, name in enumerate(NAMES):
        write_image(folder / name, pixels(seed))
    return folder


def touch(path: Path) -> None:
    """Another time of change, and nothing else."""
    times = path.stat()
    os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns + 1))


def test_a_file_has_the_fingerprint_of_its_name_size_and_time(tmp_path):
    path = tmp_path / "felt.npz"
    write(texture(0), path)
    fingerprint = source_fingerprint(path)
    assert source_fingerprint(str(path)) == fingerprint
    (tmp_path / "other").mkdir()
    moved = Path(shutil.copy2(path, tmp_path / "other"))
    assert source_fingerprint(moved) == fingerprint
    touch(moved)
    assert source_fingerprint(moved) != fingerprint
    copied = Path(shutil.copy2(path, tmp_path / "silk.npz"))
    assert source_fingerprint(copied) != fingerprint
    moved.write_bytes(path.read_bytes() + b" ")
    shutil.copystat(path, moved)
    assert source_fingerprint(moved) != fingerprint


@pytest.mark.parametrize("name", ["directions.csv", "a.png", "more/b.png"])
def test_photographs_have_the_fingerprint_of_the_list_and_all_images(photographs, name):
    sources = photographs, photographs / "directions.csv"
    fingerprints = [source_fingerprint(source) for source in sources]
    (photographs / "model.state").write_text("what a training writes here changes nothing")
    assert [source_fingerprint(source) for source in sources] == fingerprints
    touch(photographs / name)
    for source, fingerprint in zip(sources, fingerprints, strict=True):
        assert source_fingerprint(source) != fingerprint


def test_images_that_were_loaded_are_not_looked_at_again(photographs, monkeypatch):
    fingerprint, loaded = source_fingerprint(photographs), load_btf(photographs)
    monkeypatch.setattr("nacre.measured.textures.image_folder.read_header", None)
    assert source_fingerprint(photographs, source_files(photographs, loaded)) == fingerprint


def test_a_folder_keeps_its_fingerprint_when_it_is_moved(photographs, tmp_path, monkeypatch):
    fingerprint = source_fingerprint(photographs)
    (tmp_path / "other").mkdir()
    moved = photographs.rename(tmp_path / "other" / "felt")
    assert source_fingerprint(moved) == fingerprint
    monkeypatch.chdir(moved)
    assert source_fingerprint(".") == fingerprint


def test_images_named_by_directions_have_the_fingerprint_of_all(utia):
    fingerprint = source_fingerprint(utia)
    touch(utia / NAMES[1])
    touched = source_fingerprint(utia)
    assert touched != fingerprint
    write_image(utia / "tl075_pl000_tv000_pv000.png", pixels(2))
    assert source_fingerprint(utia) not in (fingerprint, touched)


def test_what_is_no_texture_is_refused(tmp_path):
    with pytest.raises(FormatError, match="absent"):
        source_fingerprint(tmp_path / "absent")
    with pytest.raises(FormatError, match="is a directory with neither"):
        source_fingerprint(tmp_path)
