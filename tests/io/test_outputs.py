"""What is replaced, and what never is without being told."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

import pytest

from nacre.errors import FormatError
from nacre.io.files import atomic_path, check_writable
from nacre.io.outputs import check_replaceable, overwrite, written_by


def write(path: Path, text: str) -> None:
    with atomic_path(path) as temporary:
        temporary.write_text(text)


def refused(path: Path, problem: str) -> None:
    before = path.read_bytes()
    for attempt in (lambda: write(path, "new"), lambda: check_writable(path)):
        with pytest.raises(FormatError, match=f"{problem}.*--force"):
            attempt()
    assert path.read_bytes() == before
    assert [p.name for p in path.parent.iterdir()] == [path.name]


def test_a_file_of_somebody_else_stays(tmp_path: Path):
    path = tmp_path / "satin.bsdf"
    path.write_text("measured for days")
    refused(path, "nothing in it says that nacre wrote it")
    with overwrite(False), pytest.raises(FormatError):
        write(path, "new")
    with overwrite():
        write(path, "new")
    assert path.read_text() == "new"


def test_a_measured_table_cannot_say_who_wrote_it(tmp_path: Path):
    path = tmp_path / "satin.binary"
    write(path, "by nacre")
    write(path, "by the same program")
    assert path.read_text() == "by the same program"
    with written_by("nacre convert"):
        refused(path, ".binary files do not say who wrote them")
    path.write_text("measured for days")
    refused(path, ".binary files do not say who wrote them")


def test_what_a_command_wrote_it_may_write_again(tmp_path: Path):
    path = tmp_path / "cloth.svg"
    with written_by("nacre btf capture"):
        write(path, "sheet")
        write(path, "sheet again")
    with written_by("nacre render"):
        refused(path, "was written by nacre btf capture")
    write(path, "by a program of the user's")
    assert path.read_text().startswith("by a program of the user's")
    with written_by("nacre render"):
        refused(path, "was written by a program")


def test_a_copied_or_moved_file_is_known(tmp_path: Path):
    path, moved = tmp_path / "a" / "cloth.svg", tmp_path / "b" / "other.svg"
    for each in (path, moved):
        each.parent.mkdir()
    with written_by("nacre render"):
        write(path, "picture")
        path.rename(moved)
        write(moved, "again")
    assert moved.read_text().startswith("again")


def test_what_was_changed_since_is_no_longer_ours(tmp_path: Path):
    path = tmp_path / "codes.json"
    write(path, '{\n "a": 1\n}\n')
    path.write_text(path.read_text().replace("1", "2", 1))
    refused(path, "was changed since nacre wrote it")


def test_a_file_that_is_read_only_stays(tmp_path: Path):
    path = tmp_path / "kept.safetensors"
    write(path, "old")
    path.chmod(0o444)
    refused(path, "read-only")
    with overwrite():
        write(path, "new")
    assert path.read_text() == "new"
    assert stat.S_IMODE(path.stat().st_mode) == 0o444


def test_the_mode_stays(tmp_path: Path):
    path = tmp_path / "private.txt"
    write(path, "old")
    path.chmod(0o600)
    write(path, "new")
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="needs root")
def test_a_file_of_another_user_stays(tmp_path: Path):
    path = tmp_path / "shared.txt"
    write(path, "old")
    os.chown(path, 12345, -1)
    refused(path, "belongs to another user")


def test_a_link_stays(tmp_path: Path):
    target, link = tmp_path / "a" / "measured.bsdf", tmp_path / "b" / "x.bsdf"
    for path in (target, link):
        path.parent.mkdir()
    write(target, "measured")
    link.symlink_to(target)
    refused(link, "symbolic link")
    with overwrite():
        write(link, "new")
    assert (target.read_text(), link.read_text(), link.is_symlink()) == ("measured", "new", False)


def test_files_of_our_own_need_no_question(tmp_path: Path):
    path = tmp_path / "x.state"
    path.write_text("anything")
    with atomic_path(path, internal=True) as temporary:
        temporary.write_text("new")
    assert path.read_text() == "new"


def test_a_pipe_stays(tmp_path: Path):
    path = tmp_path / "x.json"
    os.mkfifo(path)
    with pytest.raises(FormatError, match=r"is not a regular file.*--force"):
        check_writable(path)
    assert stat.S_ISFIFO(path.lstat().st_mode)


def test_a_file_that_cannot_be_read_is_said_to_be_so(tmp_path: Path, monkeypatch):
    path = tmp_path / "a.txt"
    path.write_text("old\n")

    def fail(_: Path):
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr("nacre.io.outputs.read_mark", fail)
    with pytest.raises(FormatError, match="exists and cannot be read: Input/output error; name"):
        check_replaceable(path)
