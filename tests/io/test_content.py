"""What unknown content looks like, and what is said about it."""

import pytest

from nacre.errors import FormatError
from nacre.formats import identify
from nacre.io.content import formats_like, is_text, looks_like


@pytest.mark.parametrize(
    ("head", "words"),
    [
        (b"<?xml version='1.0'?>\n<root a='1'><x/></root>", "XML (<root>)"),
        (b'{"metadata": {"type": 1}, "data": []}', 'JSON (with "metadata", "type", "data")'),
        (b"1 2 3\n4 5 6\n", "a table as text, which begins '1 2 3'"),
        (b"\n\nhello\nworld", "text, which begins 'hello'"),
        ("hällo".encode(), "text, which begins 'hällo'"),
        (b"\x89HDF\r\n\x1a\n\0\0", "HDF5 data"),
        (b"\0\1\2\3", "binary data"),
    ],
)
def test_what_it_looks_like(head, words):
    assert looks_like(head) == words


def test_only_text_is_text():
    assert is_text(b"theta\t0.5\r\n")
    assert is_text("µ".encode("latin-1"))
    assert not is_text(b"\x89PNG\r\n\x1a\n\0")
    assert formats_like(b"<a/>") == ("Radiance BSDF", "MaterialX")


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        (
            "a.xml",
            "<blinds/>",
            "it is XML (<blinds>); the nearest are Radiance BSDF (.xml) and MaterialX",
        ),
        ("a.bsdf", "Version 1", "begins 'Version 1'; the nearest are RGL (.bsdf) and Zemax"),
        (
            "README.md",
            "# A title\n\ntext",
            "begins '# A title'; docs/reference/formats.md lists",
        ),
        (
            "a.json",
            '{"x": 1}',
            'it is JSON (with "x"); the nearest are analytic (.json) and OpenMATERIAL 3D',
        ),
    ],
)
def test_an_unknown_file_is_named_with_the_nearest_formats(tmp_path, name, content, message):
    path = tmp_path / name
    path.write_text(content)
    with pytest.raises(FormatError) as raised:
        identify(path)
    assert message in str(raised.value)
    assert len(str(raised.value).removeprefix(str(path))) < 160
