"""The manifest outlives whatever happens to its file."""

from __future__ import annotations

import errno
import os
from dataclasses import replace

import pytest

from nacre.errors import FormatError
from nacre.workflows import MANIFEST, Manifest, Record
from tests.workflows.support import lines

A = Record("a.csv", "00", 1, 2, "s", "1", "a.json", "11", {"loss": 0.5}, 1.5)
B = Record("sub/b \udc80é.csv", "00", 1, 2, "s", "1", "sub/b.json", None, {}, 0.0, "is empty")


def test_records_come_back_as_they_were_kept(tmp_path):
    manifest = Manifest(tmp_path)
    manifest.keep(B)
    manifest.keep(A)
    again = Manifest(tmp_path)
    assert again.records() == [A, B]
    assert again.find("a.json") == A
    assert again.find("c.json") is None
    assert again.find("../a.json") is None


def test_the_last_line_on_a_material_counts_and_tidying_leaves_that(tmp_path):
    manifest = Manifest(tmp_path)
    for record in (B, A, replace(A, seconds=9.0), replace(B, error=None, output_sha256="2")):
        manifest.keep(record)
    assert len(lines(tmp_path)) == 4
    manifest.tidy(set())
    assert [line["output"] for line in lines(tmp_path)] == ["a.json", "sub/b.json"]
    assert Manifest(tmp_path).find("a.json").seconds == 9.0
    before = (tmp_path / MANIFEST).stat()
    Manifest(tmp_path).tidy(set())
    assert (tmp_path / MANIFEST).stat().st_ino == before.st_ino


def test_a_material_has_one_record_for_networks_and_one_for_models(tmp_path):
    manifest = Manifest(tmp_path)
    manifest.keep(A)
    manifest.keep(replace(A, output="a.safetensors"))
    manifest.keep(replace(A, output="a.csv.json"))
    outputs = {"a.csv.json", "a.safetensors"}
    assert {record.output for record in manifest.records()} == outputs
    assert {record.output for record in Manifest(tmp_path).records()} == outputs


def test_failures_that_were_not_met_again_are_forgotten(tmp_path):
    manifest = Manifest(tmp_path)
    manifest.keep(A)
    manifest.keep(B)
    manifest.tidy({B.output})
    assert Manifest(tmp_path).records() == [A, B]
    manifest.tidy({A.output})
    assert Manifest(tmp_path).records() == [A]


def test_a_torn_line_costs_only_its_own_material(tmp_path):
    manifest = Manifest(tmp_path)
    manifest.keep(A)
    first = (tmp_path / MANIFEST).stat().st_size
    manifest.keep(B)
    whole = (tmp_path / MANIFEST).read_bytes()
    for length in range(first, len(whole) - 1):
        (tmp_path / MANIFEST).write_bytes(whole[:length])
        torn = Manifest(tmp_path)
        assert torn.records() == [A]
        torn.keep(replace(B, output="c.json"))
        assert Manifest(tmp_path).records() == [A, replace(B, output="c.json")]


@pytest.mark.parametrize(
    "line",
    [b"", b"{}", b"[]", b"null", b"\xff\0", b"[" * 5000, b'{"source": 1}', b'{"source": "a"}'],
)
def test_lines_that_say_nothing_are_ignored(tmp_path, line):
    Manifest(tmp_path).keep(A)
    with (tmp_path / MANIFEST).open("ab") as file:
        file.write(line + b"\n")
    manifest = Manifest(tmp_path)
    assert manifest.records() == [A]
    manifest.tidy(set())
    assert len(lines(tmp_path)) == 1


def test_a_full_disk_leaves_whole_lines(tmp_path, monkeypatch):
    manifest = Manifest(tmp_path)
    manifest.keep(A)
    before = (tmp_path / MANIFEST).read_bytes()

    def full(descriptor):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(FormatError, match="No space left"):
        manifest.keep(B)
    manifest.tidy(set())
    assert (tmp_path / MANIFEST).read_bytes() == before
    assert os.listdir(tmp_path) == [MANIFEST]  # noqa: PTH208


def test_a_manifest_that_is_a_folder_is_an_error(tmp_path):
    (tmp_path / MANIFEST).mkdir()
    with pytest.raises(FormatError, match=MANIFEST):
        Manifest(tmp_path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_manifest_that_is_a_pipe_is_an_error(tmp_path):
    os.mkfifo(tmp_path / MANIFEST)
    with pytest.raises(FormatError, match="is not a regular file"):
        Manifest(tmp_path)


def test_a_manifest_of_any_size_is_not_read(tmp_path):
    path = tmp_path / MANIFEST
    with path.open("wb") as file:
        file.truncate(1 << 34)  # a hole, which takes no room on the disk
    with pytest.raises(FormatError, match="is larger than 256 MiB"):
        Manifest(tmp_path)
    assert path.stat().st_size == 1 << 34


def test_a_link_is_not_followed(tmp_path):
    elsewhere = tmp_path / "notes.jsonl"
    elsewhere.write_text("")
    (tmp_path / "fits").mkdir()
    (tmp_path / "fits" / MANIFEST).symlink_to(elsewhere)
    with pytest.raises(FormatError, match="is a symbolic link"):
        Manifest(tmp_path / "fits").keep(A)
    assert elsewhere.read_text() == ""
