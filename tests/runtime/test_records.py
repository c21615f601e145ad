"""Records in a file that grows: what was added is there again, whatever happened to the end."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from nacre.errors import FormatError, NacreError
from nacre.runtime.records import Records

THREE = [b"first", b"other", b"third"]


def records(folder: Path, fingerprint: str = "made", size: int = 5) -> Records:
    return Records(folder / "x.state", fingerprint, size)


def test_what_was_added_is_there_again(tmp_path: Path):
    kept = records(tmp_path)
    assert list(kept.load()) == []
    kept.add([])
    assert list(records(tmp_path).load()) == []
    before = (tmp_path / "x.state").read_bytes()
    kept.add(THREE[:2])
    records(tmp_path).add(THREE[2:])
    assert list(records(tmp_path).load()) == THREE
    assert (tmp_path / "x.state").read_bytes().startswith(before)


def test_a_file_cut_short_anywhere_loses_the_last_record_only(tmp_path: Path):
    records(tmp_path).add(THREE)
    whole = (tmp_path / "x.state").read_bytes()
    for cut in range(1, 9):
        (tmp_path / "x.state").write_bytes(whole[:-cut])
        assert list(records(tmp_path).load()) == THREE[:2]
        records(tmp_path).add([b"again"])
        assert list(records(tmp_path).load()) == [*THREE[:2], b"again"]


def test_a_changed_byte_is_found(tmp_path: Path):
    records(tmp_path).add(THREE)
    whole = (tmp_path / "x.state").read_bytes()
    for place in range(len(whole) - 27, len(whole)):
        damaged = bytearray(whole)
        damaged[place] ^= 1
        (tmp_path / "x.state").write_bytes(damaged)
        index = (place - len(whole) + 27) // 9
        assert list(records(tmp_path).load()) == THREE[:index] + THREE[index + 1 :]


def test_other_work_and_other_files_are_refused(tmp_path: Path):
    records(tmp_path).add(THREE)
    for other in (records(tmp_path, "other"), records(tmp_path, size=6)):
        with pytest.raises(NacreError, match=r"x\.state: belongs to another run; remove it"):
            list(other.load())
    for content in (b"", b"x" * 50, b"[]\n", json.dumps({"other": 1}).encode(), bytes(1 << 17)):
        (tmp_path / "x.state").write_bytes(content)
        with pytest.raises(NacreError, match=r"x\.state: cannot be read, remove it to start over"):
            list(records(tmp_path).load())


def test_nothing_is_kept_without_a_path():
    kept = Records(None, "", 5)
    kept.add(THREE)
    assert list(kept.load()) == []


def test_a_file_without_room_has_what_it_had(tmp_path: Path):
    resource = pytest.importorskip("resource", reason="files have no largest size here")
    kept = records(tmp_path, size=1000)
    kept.add([bytes(1000)])
    before = (tmp_path / "x.state").read_bytes()
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, limits[1]))
    try:
        with pytest.raises(FormatError, match=r"x\.state: cannot be written: File too large"):
            kept.add([bytes(1000)] * 20)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert (tmp_path / "x.state").read_bytes() == before
