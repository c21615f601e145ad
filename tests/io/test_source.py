"""Where a material came from: name, hash, terms; and what is not claimed of a file that changed."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import pytest

from nacre.io.source import TERMS, Source


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "satin.bsdf"
    path.write_bytes(b"numbers")
    return path


def test_a_file_has_its_name_and_the_hash_of_its_bytes(path: Path) -> None:
    source = Source(path)
    assert dict(source) == {"file": path.name, "sha256": hashlib.sha256(b"numbers").hexdigest()}
    assert len(source) == 2
    assert repr(source) == "Source('satin.bsdf')"
    with pytest.raises(KeyError):
        source["terms"]


def test_the_hash_stays_once_it_was_asked_for(path: Path) -> None:
    source = Source(path)
    before = source["sha256"]
    path.write_bytes(b"other numbers")
    assert source["sha256"] == before


@pytest.mark.parametrize("change", ["written", "gone"])
def test_a_file_that_changed_before_has_no_hash(path: Path, change: str) -> None:
    source = Source(path)
    if change == "written":
        path.write_bytes(b"other numbers")
        os.utime(path, ns=(1, 1))
    else:
        path.unlink()
    assert dict(source) == {"file": path.name}
    assert len(source) == 1
    with pytest.raises(KeyError):
        source["sha256"]


def test_terms_lie_beside_the_file_on_one_line(path: Path) -> None:
    (path.parent / f"a{TERMS}").write_text("Free for\n  research.\n")
    (path.parent / f"b{TERMS}").write_text("Others.")
    assert Source(path)["terms"] == "Free for research."
    assert list(Source(path)) == ["file", "sha256", "terms"]
    (path.parent / f"a{TERMS}").write_bytes(bytes((1 << 14) + 1))  # too long: no terms of ours
    assert Source(path)["terms"] == "Others."


def test_a_folder_has_a_name_only(tmp_path: Path) -> None:
    assert dict(Source(tmp_path)) == {"file": tmp_path.name}
