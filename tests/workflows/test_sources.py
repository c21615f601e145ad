"""Which files of a folder are materials, and what their fits are called."""

from __future__ import annotations

import os
from pathlib import Path, PurePosixPath

import numpy as np
import pytest

import nacre
from nacre.errors import FormatError
from nacre.formats import is_measured
from nacre.neural import Layer, NeuralBrdf
from nacre.workflows import Source, find_sources, output_names
from tests.scans import Gloss, scan
from tests.workflows.support import table


def relative(sources: list[Source]) -> list[str]:
    return [str(source.relative) for source in sources]


@pytest.fixture
def network() -> NeuralBrdf:
    random = np.random.default_rng(0)
    return NeuralBrdf(
        [
            Layer(random.normal(0, 0.5, (6, 4)).astype(np.float32), np.zeros(4, np.float32)),
            Layer(random.normal(0, 0.5, (4, 3)).astype(np.float32), np.zeros(3, np.float32)),
        ]
    )


def test_measurements_are_found_at_any_depth_and_nothing_else(tmp_path, network):
    table(tmp_path / "b.binary")
    table(tmp_path / "deep/er/A.BINARY")
    table(tmp_path / ".hidden.binary")
    table(tmp_path / ".trash/x.binary")
    table(tmp_path / "lib/x.binary")
    nacre.save(scan(Gloss(), 40), tmp_path / "scan.csv")
    nacre.save(network, tmp_path / "fit.safetensors")
    nacre.save(network, tmp_path / "fit.h5")
    (tmp_path / "damaged.bsdf").write_bytes(b"")
    for name, content in (
        ("prices.csv", b"name,price\n"),
        ("notes.txt", b"theta_i"),
        ("picture.png", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\1\0\0\0\1\0"),
        ("picture.exr", b"\x76\x2f\x31\x01"),
        ("firmware.bin", bytes(100)),
        ("weights.npy", b"\x93NUMPY\1\0"),
        ("archive.npz", b"PK\3\4"),
        ("record.json", b'{"url": 1}'),
    ):
        (tmp_path / name).write_bytes(content)
    left_out: list[Path] = []
    found = find_sources([tmp_path], tmp_path / "lib", left_out.append)
    assert relative(found) == ["b.binary", "damaged.bsdf", "scan.csv", "deep/er/A.BINARY"]
    assert [path.name for path in left_out] == [
        "archive.npz",
        "firmware.bin",
        "picture.exr",
        "picture.png",
        "prices.csv",
        "weights.npy",
    ]
    assert all(source.path == tmp_path / source.relative for source in found)


def test_what_nacre_writes_of_measurements_is_found(tmp_path, network):
    for name in ("x.binary", "x.npz", "x.bsdf", "x.csv", "x.bin"):
        nacre.save(network, tmp_path / name)
        assert is_measured(tmp_path / name), name


def test_images_are_materials_only_if_they_are_tables(tmp_path, network):
    pytest.importorskip("mitsuba", reason="needs the extra 'render'")
    nacre.save(network, tmp_path / "x.exr")
    assert is_measured(tmp_path / "x.exr")
    table_of_pixels = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\1\x20\0\0\1\x20"
    (tmp_path / "x.png").write_bytes(table_of_pixels)
    assert is_measured(tmp_path / "x.png")


def test_a_file_counts_once_and_is_taken_whatever_it_holds(tmp_path):
    for name in ("a/x.binary", "a/sub/y.binary"):
        table(tmp_path / name)
    odd = tmp_path / "odd.txt"
    odd.write_text("x")
    found = find_sources([odd, tmp_path / "a/x.binary", tmp_path / "a", tmp_path / "a/sub"], "lib")
    assert relative(found) == ["odd.txt", "x.binary", "sub/y.binary"]
    with pytest.raises(FormatError, match="absent: no such file"):
        find_sources([tmp_path / "a", tmp_path / "absent"], "lib")


def test_fits_in_the_folder_that_is_searched_are_left_alone(tmp_path):
    table(tmp_path / "x.binary")
    assert relative(find_sources([tmp_path], tmp_path)) == ["x.binary"]
    assert relative(find_sources([tmp_path], tmp_path.parent)) == ["x.binary"]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_only_regular_files_are_opened(tmp_path):
    os.mkfifo(tmp_path / "x.csv")
    assert find_sources([tmp_path], "lib") == []


def names(*relative: str) -> list[str]:
    sources = [Source(Path("given") / name, PurePosixPath(name)) for name in relative]
    return output_names(sources, ".json")


def test_names_keep_folders_and_tell_apart_what_would_share_one():
    assert names("x.bsdf", "a/x.bsdf", "a/y.v2.csv") == ["x.json", "a/x.json", "a/y.v2.json"]
    assert names("x.bsdf", "x.csv", "y.csv") == ["x.bsdf.json", "x.csv.json", "y.json"]
    assert names("Gold.csv", "gold.bsdf") == ["Gold.csv.json", "gold.bsdf.json"]
    with pytest.raises(FormatError, match="same name as"):
        names("x.csv", "x.csv")
    with pytest.raises(FormatError, match="same name as"):
        names("x.csv", "X.csv")
