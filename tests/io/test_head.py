"""What a file begins with, behind comments of any length."""

from pathlib import Path

import pytest

import nacre
from nacre.errors import FormatError
from nacre.formats import identify
from nacre.io.format import HEAD
from nacre.io.head import recognized_head
from tests.specimens import SPECIMENS

_COMMENT = b"# measured by a laboratory\n"


@pytest.mark.parametrize("count", [0, 1, 50, 5_000, 100_000])
@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"])
def test_the_first_bytes_behind_comments_follow(tmp_path, count, end):
    path = tmp_path / "scan"
    path.write_bytes(count * _COMMENT.replace(b"\n", end) + b"\n\nSource Measured\n" + 2000 * b"1 ")
    head = recognized_head(path)
    assert b"Source Measured" in head
    assert len(head) <= 3 * HEAD + 2


@pytest.mark.parametrize(
    "text", [b"#?RADIANCE\n# a\nx", b"#usda 1.0\n# a\nx", b"plain # text", b"\1\2\3# no"]
)
def test_other_files_are_seen_as_they_are(tmp_path, text):
    path = tmp_path / "file"
    path.write_bytes(text)
    assert recognized_head(path) == text


def test_one_long_line_and_a_file_of_comments(tmp_path):
    path = tmp_path / "scan"
    path.write_bytes(b"#" + 3_000_000 * b"x" + b"\nSource\n")
    assert recognized_head(path).endswith(b"\nSource\n")
    path.write_bytes(20_000_000 * b"#")
    assert len(recognized_head(path)) <= 3 * HEAD + 2
    path.write_bytes(b"")
    with pytest.raises(FormatError, match="empty"):
        recognized_head(path)


@pytest.mark.parametrize("length", [0, 10, 3_000, 100_000])
def test_xml_is_known_behind_comments(tmp_path, length):
    """As Radiance's programs write the whole command before the first element."""
    content = SPECIMENS["Radiance BSDF"].files()[0]
    _, mark, rest = content.partition(b"<WindowElement")
    declared = b'<?xml version="1.0" encoding="UTF-8"?>\n'
    comments = b"<!-- made by: a -->\n<!-- a - b -- " + length * b"> " + b"\n-->\n"
    path = tmp_path / "tree"
    path.write_bytes(declared + comments + mark + rest)
    assert identify(path).name == "Radiance BSDF"
    path.write_bytes(declared + b"<!-- " + length * b"x")
    with pytest.raises(FormatError, match="of no known format"):
        identify(path)


@pytest.mark.parametrize("name", ["Zemax BSDF", "comma-separated samples", "Cornell scan"])
@pytest.mark.parametrize("upper", [False, True])
def test_text_formats_are_known_behind_comments(tmp_path, name, upper):
    """Behind 3 kB of comments, a byte order mark and CRLF, and with a name in capitals."""
    specimen = SPECIMENS[name]
    content = specimen.files()[0]
    ending = "".join(Path(specimen.name).suffixes)
    path = tmp_path / f"scan{ending.upper() if upper else ending}"
    path.write_bytes(b"\xef\xbb\xbf" + (120 * _COMMENT + content).replace(b"\n", b"\r\n"))
    assert identify(path).name == name
    plain = tmp_path / f"plain{ending}"
    plain.write_bytes(content)
    light, view = [0.5, 0.0, 0.75**0.5], [0.0, 0.0, 1.0]
    assert nacre.load(path).eval(light, view) == pytest.approx(nacre.load(plain).eval(light, view))
