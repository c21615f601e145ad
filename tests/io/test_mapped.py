"""Mapped files: their bytes, whoever takes their name, and what has changed since."""

from __future__ import annotations

import copy
import os
from pathlib import Path

import pytest

from nacre.errors import FormatError
from nacre.io.mapped import MappedFile


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "a.bin"
    path.write_bytes(b"abcdef")
    os.utime(path, ns=(10**18, 10**18))
    return path


def test_the_bytes_are_those_of_the_file(path: Path) -> None:
    mapped = MappedFile(path, 6)
    assert mapped.data[:] == b"abcdef"
    mapped.release()
    assert mapped.data[2:4] == b"cd"
    mapped.check()
    assert copy.copy(mapped) is None


def test_a_file_that_takes_its_name_changes_nothing(path: Path) -> None:
    mapped = MappedFile(path, 6)
    other = path.with_name("b.bin")
    other.write_bytes(b"other")
    other.replace(path)
    mapped.check()
    assert mapped.data[:] == b"abcdef"


def test_an_open_file_is_mapped_whatever_its_name(path: Path) -> None:
    with path.open("rb") as file:
        path.unlink()
        mapped = MappedFile(path, 6, file.fileno())
    assert mapped.data[:] == b"abcdef"
    mapped.check()


@pytest.mark.parametrize("content", [b"ABCDEF", b"abcdefg", b"abc"])
def test_a_file_that_was_written_over_is_refused(path: Path, content: bytes) -> None:
    mapped = MappedFile(path, 10)
    path.write_bytes(content)
    with pytest.raises(FormatError, match="has changed since it was read"):
        mapped.check()


def test_what_cannot_be_mapped_is_refused(path: Path, tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="6 bytes, more than the 5"):
        MappedFile(path, 5)
    (tmp_path / "empty").touch()
    with pytest.raises(FormatError, match="is empty"):
        MappedFile(tmp_path / "empty", 5)
    with pytest.raises(FormatError, match=r"absent.*no such file"):
        MappedFile(tmp_path / "absent", 5)


def test_files_are_closed_with_their_maps(path: Path) -> None:
    before = len(os.listdir("/proc/self/fd"))  # noqa: PTH208
    for _ in range(10):
        MappedFile(path, 6)
    assert len(os.listdir("/proc/self/fd")) <= before + 1  # noqa: PTH208
