"""Lines of text files, and numbers in their cells."""

from __future__ import annotations

from pathlib import Path

import pytest

from nacre.errors import FormatError
from nacre.io.text_file import LINE_LIMIT, parse_number, read_lines


def test_lines_are_numbered_and_a_mark_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_bytes(b"\xef\xbb\xbfa\r\n\nb")
    assert list(read_lines(path, 100)) == [(1, "a\n"), (2, "\n"), (3, "b")]
    path.write_bytes(b"a\n" + b"b" * (LINE_LIMIT + 1))
    lines = read_lines(path, 1 << 20)
    assert next(lines) == (1, "a\n")
    with pytest.raises(FormatError, match=r"x\.csv: line 2: is longer"):
        next(lines)
    with pytest.raises(FormatError, match="more than the 100"):
        read_lines(path, 100)


def test_numbers_are_plain_and_finite() -> None:
    assert [parse_number(cell) for cell in ("1", " -2.5e3 ", "+.5")] == [1.0, -2500.0, 0.5]
    for cell in ("", "x", "1_0", "٣", "１", "nan", "inf", "-Infinity", "1e999", "0x10"):
        with pytest.raises(ValueError, match=r".*"):
            parse_number(cell)
