"""XML files: what is read, and what is refused before it costs anything."""

from __future__ import annotations

from pathlib import Path

import pytest

from nacre.errors import FormatError
from nacre.io.xml_file import DEPTH_LIMIT, read_xml


def nested(depth: int) -> str:
    return "<a>" * depth + "</a>" * depth


def write(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "a.xml"
    path.write_text(text, encoding="utf-8")
    return path


def test_elements_attributes_and_texts_are_read(tmp_path: Path) -> None:
    root = read_xml(write(tmp_path, '<m:a x="1"><b>é &amp; <c/>tail</b><b/></m:a>'), 1000)
    assert (root.tag, root.attrib) == ("m:a", {"x": "1"})
    assert [child.tag for child in root.iter()] == ["m:a", "b", "c", "b"]
    assert root[0].text == "é & "
    assert root[0][0].tail == "tail"


def test_elements_may_be_as_deep_as_the_limit(tmp_path: Path) -> None:
    assert len(list(read_xml(write(tmp_path, nested(DEPTH_LIMIT)), 1000).iter())) == DEPTH_LIMIT
    siblings = f"<r>{nested(DEPTH_LIMIT - 1) * 3}</r>"
    assert len(list(read_xml(write(tmp_path, siblings), 10_000).iter())) == 3 * DEPTH_LIMIT - 2
    with pytest.raises(FormatError, match=rf"line 1: more than {DEPTH_LIMIT} elements"):
        read_xml(write(tmp_path, nested(DEPTH_LIMIT + 1)), 1000)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>', "declares a document type"),
        ("<a><b></a>", "is not whole XML: mismatched tag"),
        ("<a>", "is not whole XML: no element found"),
        ('<?xml version="1.0" encoding="none"?><a/>', "is not whole XML: unknown encoding"),
        ("<a/>" + " " * 100, "104 bytes, more than the 100"),
    ],
)
def test_what_is_no_plain_tree_is_refused(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(FormatError, match=words):
        read_xml(write(tmp_path, text), 100)
