"""Files are whole or absent, and errors say what to do."""

from __future__ import annotations

import errno
import hashlib
import itertools
import os
import platform
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from nacre.errors import FormatError, MissingExtraError, require
from nacre.io.files import (
    append_line,
    atomic_path,
    check_not_inputs,
    read_bytes,
    read_head,
    remove_file,
    write_together,
)
from nacre.io.outputs import overwrite


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path):
    target = tmp_path / "x.bin"
    with atomic_path(target) as temporary:
        temporary.write_bytes(b"old")

    def fail():
        with atomic_path(target) as temporary:
            temporary.write_bytes(b"half")
            raise RuntimeError("power cut")

    with pytest.raises(RuntimeError):
        fail()
    assert target.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [target]


def test_a_write_replaces_the_file_whole(tmp_path):
    target = tmp_path / "x.bin"
    with atomic_path(target) as temporary:
        temporary.write_bytes(b"old")
    with atomic_path(target) as temporary:
        assert temporary.suffix == ".bin"
        temporary.write_bytes(b"new")
    assert target.read_bytes() == b"new"
    assert list(tmp_path.iterdir()) == [target]


def test_a_file_that_comes_while_another_is_written_stays(tmp_path):
    target = tmp_path / "x.bin"

    def write():
        with atomic_path(target) as temporary:
            temporary.write_bytes(b"ours")
            target.write_bytes(b"the user's")

    with pytest.raises(FormatError, match=r"exists, and \.bin files do not say who wrote them"):
        write()
    assert target.read_bytes() == b"the user's"
    assert list(tmp_path.iterdir()) == [target]
    with overwrite():
        write()
    assert target.read_bytes() == b"ours"


@pytest.mark.parametrize("bad", range(3))
@pytest.mark.parametrize("call", ["fsync", "replace"])
def test_of_files_that_belong_together_all_appear_or_none(tmp_path, monkeypatch, bad, call):
    paths = [tmp_path / name for name in ("a.npy", "b.npy", "c.npy")]
    calls = itertools.count()
    real = getattr(os, call)

    def failing(*arguments):
        if next(calls) == bad:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return real(*arguments)

    monkeypatch.setattr(os, call, failing)
    contents = dict.fromkeys(paths, b"new")
    with pytest.raises(FormatError, match="No space left"):
        write_together(contents)
    assert list(tmp_path.iterdir()) == []
    monkeypatch.undo()
    write_together(contents)
    assert sorted(tmp_path.iterdir()) == paths


def test_of_files_that_belong_together_none_replaces_a_users(tmp_path):
    theirs = tmp_path / "b.npy"
    theirs.write_bytes(b"the user's")
    with pytest.raises(FormatError, match=r"b\.npy: exists"):
        write_together(dict.fromkeys((tmp_path / "a.npy", theirs), b"new"))
    assert list(tmp_path.iterdir()) == [theirs]
    assert theirs.read_bytes() == b"the user's"


def test_threads_write_with_the_permissions_of_any_file(tmp_path):
    def write(name):
        with atomic_path(tmp_path / str(name)) as temporary:
            temporary.write_bytes(b"x")

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(write, range(200)))
    (tmp_path / "plain").touch()
    modes = {path.stat().st_mode for path in tmp_path.iterdir()}
    assert len(modes) == 1
    assert len(list(tmp_path.iterdir())) == 201


@pytest.mark.parametrize("place", ["missing/x.bin", "."])
def test_writing_where_no_file_can_be_is_an_error(tmp_path, place):
    with (
        pytest.raises(FormatError, match=r"directory|does not exist"),
        atomic_path(tmp_path / place),
    ):
        pytest.fail("the block must not run")


def test_reading_says_what_is_wrong(tmp_path):
    (tmp_path / "empty").touch()
    (tmp_path / "large").write_bytes(bytes(11))
    for name, words in {
        ".": "directory",
        "absent": "no such file",
        "empty": "is empty",
        "large": "11 bytes, more than the 10",
    }.items():
        with pytest.raises(FormatError, match=words) as caught:
            read_bytes(tmp_path / name, 10)
        assert str(tmp_path) in str(caught.value)
        assert "\n" not in str(caught.value)


def test_a_broken_extra_says_why(tmp_path, monkeypatch):
    (tmp_path / "a_broken_module.py").write_text("raise OSError('libatomic.so.1: not found')")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(MissingExtraError, match=r"does not load: libatomic\.so\.1: not found"):
        require("a_broken_module", "render")


def test_a_missing_extra_names_itself():
    with pytest.raises(MissingExtraError, match=r"pip install 'nacre-materials\[render\]'"):
        require("a_module_that_does_not_exist", "render")


def test_messages_are_one_printable_line():
    assert str(FormatError("a\nb\x1b[2J\ud800 é")) == "a\\nb\\x1b[2J\\ud800 é"


def test_what_was_left_of_a_state_goes_with_it(tmp_path):
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    name = hashlib.sha256(os.fsencode(f"{platform.node()}/a.state")).hexdigest()[:6]
    left, other = (tmp_path / f".{mark}{process.pid:06x}0000.state" for mark in (name, "abcdef"))
    for path in (left, other, tmp_path / "a.state"):
        path.touch()
    remove_file(tmp_path / "a.state")
    assert list(tmp_path.iterdir()) == [other]


def test_what_a_killed_process_left_goes_when_the_file_is_written_again(tmp_path):
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    target = tmp_path / "x.bin"
    name = hashlib.sha256(os.fsencode(f"{platform.node()}/x.bin")).hexdigest()[:6]
    left = tmp_path / f".{name}{process.pid:06x}0000.bin"
    running = tmp_path / f".{name}{os.getpid():06x}0000.bin"
    for path in (left, running):
        path.touch()
    with atomic_path(target) as temporary:
        temporary.write_bytes(b"new")
    assert set(tmp_path.iterdir()) == {target, running}


def test_lines_are_added_whole_and_each_on_its_own(tmp_path):
    path = tmp_path / "log.jsonl"
    for line in ("one\n", "two\n"):
        append_line(path, line)
    assert path.read_bytes() == b"one\ntwo\n"
    path.write_bytes(b"one\ntw")  # as a killed process leaves it
    append_line(path, "three\n")
    assert path.read_bytes() == b"one\ntw\nthree\n"


def test_heads_are_read_anew_when_a_file_changes(tmp_path):
    path = tmp_path / "x.bin"
    path.write_bytes(b"abcdef")
    os.utime(path, ns=(10**18, 10**18))
    assert read_head(path, 4) == read_head(path, 4) == b"abcd"
    assert read_head(path) == b"abcdef"
    path.write_bytes(b"ghijkl")
    os.utime(path, ns=(10**18 + 1, 10**18 + 1))
    assert read_head(path, 4) == b"ghij"
    path.write_bytes(b"")
    with pytest.raises(FormatError, match="is empty"):
        read_head(path)


def test_an_output_is_no_input(tmp_path):
    (tmp_path / "a").touch()
    (tmp_path / "link").symlink_to("a")
    check_not_inputs([tmp_path / "b"], [tmp_path / "a"])
    for output in ("a", "link", "../" + tmp_path.name + "/a"):
        with pytest.raises(FormatError, match="is the input as well"):
            check_not_inputs([tmp_path / "b", tmp_path / output], [tmp_path / "a"])
