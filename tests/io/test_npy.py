"""NumPy's array files: what NumPy writes is read, what promises too much is refused."""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from pathlib import Path

import numpy as np
import pytest
from numpy.lib import format as npy

from nacre.errors import FormatError
from nacre.io.mapped import MappedFile
from nacre.io.npy import MAGIC, archive_errors, map_npy, parse_npy, parse_text, unpack_member


def written(array: np.ndarray, version: tuple[int, int] = (1, 0)) -> bytes:
    content = io.BytesIO()
    npy.write_array(content, array, version)
    return content.getvalue()


@pytest.mark.parametrize("dtype", ["<f2", ">f4", "<f8"])
@pytest.mark.parametrize("shape", [(), (3,), (2, 3), (2, 3, 4)])
@pytest.mark.parametrize("order", ["C", "F"])
def test_what_numpy_writes_is_read(dtype, shape, order):
    size = int(np.prod(shape))
    array = np.asarray(np.arange(size).reshape(shape), dtype=dtype, order=order)
    data = written(array)
    assert data.startswith(MAGIC)
    back = parse_npy(data, "x.npy")
    assert back.dtype == array.dtype
    np.testing.assert_array_equal(back, array)
    with pytest.raises(ValueError, match="read-only"):
        back[...] = 0


def header(shape: str, descr: str = "'<f8'") -> bytes:
    text = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return MAGIC + b"\1\0" + len(text).to_bytes(2, "little") + text


@pytest.mark.parametrize(
    "data",
    [
        b"",
        MAGIC,
        written(np.zeros(3))[:-1],
        written(np.zeros(3)) + b"\0",
        written(np.zeros(3, int)),
        written(np.zeros(3), (2, 0)),
        header("(3,)", "'<f16'") + bytes(48),
        header("(3,)", "'|O'") + bytes(24),
        header("(3,)", "[('a', '<f8')]") + bytes(24),
        header("(-1, -3)") + bytes(24),
        header("(-3,)"),
        header("(1 << 62, 1 << 62)"),
        header(f"({2**62}, {2**62})") + bytes(24),
        header("'3'") + bytes(24),
        header("(3,)", "__import__('os')") + bytes(24),
    ],
)
def test_what_is_damaged_is_refused_in_one_line(data):
    with pytest.raises(FormatError, match=r"^x\.npy: ") as caught:
        parse_npy(data, "x.npy")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["", "cloth", "織物 \U0001f9f5"])
@pytest.mark.parametrize("order", ["<", ">"])
def test_texts_are_read(text: str, order: str) -> None:
    array = np.array(text).astype(f"{order}U{max(len(text), 1)}")
    assert parse_text(written(array), "x") == text


@pytest.mark.parametrize(
    "data",
    [
        written(np.array(["two", "texts"])),
        written(np.array("x" * 1025)),
        written(np.array(1.0)),
        written(np.array("xyz"))[:-4] + b"\0\xd8\0\0",  # half a character
        written(np.array("xyz"))[:-4] + b"\xff" * 4,
        written(np.array("xyz"))[:-1],
    ],
)
def test_what_is_no_text_is_refused(data: bytes) -> None:
    with pytest.raises(FormatError, match="x"):
        parse_text(data, "x")


def test_an_array_within_a_file_is_mapped(tmp_path: Path) -> None:
    array = np.arange(6, dtype="<f4").reshape(2, 3)
    content, path = written(array), tmp_path / "file"
    path.write_bytes(b"before" + content + b"after")
    file = MappedFile(path, 1000)
    found = map_npy(file, 6, len(content), "file")
    assert found.base is not None
    assert not found.flags.writeable
    np.testing.assert_array_equal(found, array)
    for offset, length in ((5, len(content)), (6, len(content) - 1), (6, len(content) + 4)):
        with pytest.raises(FormatError, match="file: "):
            map_npy(file, offset, length, "file")


@pytest.mark.parametrize("text", ["{'descr': ", "[]", "{}", "é", "{'descr': '<f8'}", "x" * 200_000])
def test_a_damaged_header_is_named_without_the_words_of_a_parser(text: str):
    data = MAGIC + b"\1\0" + (len(text) & 0xFFFF).to_bytes(2, "little") + text.encode()
    with pytest.raises(FormatError) as caught:
        parse_npy(data, "x.npy")
    assert str(caught.value) == "x.npy: is not a whole .npy file: its header is damaged"


def test_a_damaged_archive_is_named_without_the_words_of_a_parser():
    for error, part in ((struct.error("unpack requires"), "list"), (zlib.error("-3"), "content")):
        with pytest.raises(FormatError) as caught, archive_errors("x.npz"):
            raise error
        assert f"x.npz: is not a whole .npz archive: its {part}" in str(caught.value)


@pytest.mark.parametrize("method", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
def test_members_of_archives_are_as_long_as_they_say(method):
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", method) as archive:
        archive.writestr("x.npy", b"0123456789")
    with zipfile.ZipFile(content) as archive:
        member = archive.getinfo("x.npy")
        assert unpack_member(archive, member, 1, "x") == b"0123456789"
        member.file_size += 1
        with pytest.raises(FormatError, match="x: does not have the length that the archive says"):
            unpack_member(archive, member, 1, "x")
        member.file_size = (1 << 26) + 1
        with pytest.raises(FormatError, match="x: is larger than any table"):
            unpack_member(archive, member, 1 << 23, "x")


def test_members_of_archives_are_packed_in_the_usual_ways_only():
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_BZIP2) as archive:
        archive.writestr("x.npy", b"0123456789")
    with (
        zipfile.ZipFile(content) as archive,
        pytest.raises(FormatError, match="packed in an unusual way"),
    ):
        unpack_member(archive, archive.getinfo("x.npy"), 100, "x")
