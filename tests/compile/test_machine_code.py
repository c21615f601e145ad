"""Compiled code in files."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest

from nacre.compile.machine_code import kept


def test_code_that_cannot_be_written_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plain = Path.write_bytes

    def fail(path: Path, data: bytes) -> int:
        plain(path, data[:10])
        raise OSError(errno.ENOSPC, "No space left on device")

    path = tmp_path / "code" / "run.o"
    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_bytes", fail)
        assert kept(path, lambda: b"code") == b"code"
    assert list(path.parent.iterdir()) == []
    assert kept(path, lambda: b"code") == b"code"
    assert list(path.parent.iterdir()) == [path]
    assert kept(path, lambda: pytest.fail("it is kept")) == b"code"
