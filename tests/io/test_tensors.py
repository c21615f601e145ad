"""Safetensors files with a header: written, refused, and told apart."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np
import pytest
from safetensors import safe_open

from nacre.errors import FormatError
from nacre.io.tensors import (
    check_header,
    check_unit_vectors,
    format_errors,
    from_file,
    has_header,
    header_key,
    in_precision,
    in_single,
    looks_like_tensors,
    to_bytes,
)

KEY = "nacre test"
HEADER = {"version": 3, "metadata": {"a": [1, 2.5, "é"]}}
TENSORS = {"x": np.arange(6, dtype=np.float32).reshape(2, 3), "y": np.array([7], np.int32)}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "a.safetensors"
    path.write_bytes(to_bytes(KEY, HEADER, TENSORS, 1 << 20))
    return path


def test_another_reader_finds_the_tensors_and_the_header(path: Path) -> None:
    with safe_open(path, "np") as file:
        assert json.loads(file.metadata()[KEY]) == HEADER
        assert set(file.keys()) == set(TENSORS)
        for name, array in TENSORS.items():
            found = file.get_tensor(name)
            assert found.dtype == array.dtype
            np.testing.assert_array_equal(found, array)


def test_what_is_written_is_read_back(path: Path) -> None:
    header, tensors = from_file(path, KEY, 1 << 20, "a test")
    assert header == HEADER
    assert set(tensors) == set(TENSORS)
    np.testing.assert_array_equal(tensors["x"], TENSORS["x"])
    size = path.stat().st_size
    assert to_bytes(KEY, HEADER, TENSORS, size) == path.read_bytes()
    from_file(path, KEY, size, "a test")
    with pytest.raises(FormatError, match=f"{size} bytes, more than the {size - 1}"):
        to_bytes(KEY, HEADER, TENSORS, size - 1)
    with pytest.raises(FormatError, match="more than"):
        from_file(path, KEY, size - 1, "a test")


def test_files_of_others_are_refused(path: Path) -> None:
    with pytest.raises(FormatError, match="is a safetensors file, but not a lamp"):
        from_file(path, "nacre lamp", 1 << 20, "a lamp")
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(FormatError, match="is not a whole safetensors file"):
        from_file(path, KEY, 1 << 20, "a test")


@pytest.mark.parametrize("value", [float("nan"), float("inf"), "\ud800", {1, 2}])
def test_headers_that_are_no_json_are_not_written(value: object) -> None:
    with pytest.raises(FormatError, match="metadata cannot be written as JSON"):
        to_bytes(KEY, {"value": value}, TENSORS, 1 << 20)


def test_a_header_is_of_the_version_that_is_read() -> None:
    check_header(HEADER, 3)
    with pytest.raises(ValueError, match="version 3; this nacre reads version 4"):
        check_header(HEADER, 4)
    with pytest.raises(ValueError, match="metadata is not an object"):
        check_header({"version": 3, "metadata": []}, 3)
    with pytest.raises(ValueError, match="not JSON compliant"):
        check_header({"version": 3, "metadata": {"a": float("nan")}}, 3)
    with pytest.raises(KeyError):
        check_header({"version": 3}, 3)


def test_half_precision_is_taken_where_it_changes_nothing() -> None:
    exact = {"a": np.array([0.5, -65472.0], np.float32), "b": np.ones(2, np.float32)}
    for precision, kind in ((None, "f2"), ("half", "f2"), ("single", "f4")):
        found = in_precision(exact, precision)
        assert {array.dtype.str[1:] for array in found.values()} == {kind}
        np.testing.assert_array_equal(found["a"], exact["a"])
    for inexact in (0.1, 1e5):
        tensors = exact | {"b": np.array([1.0, inexact], np.float32)}
        assert {array.dtype.str[1:] for array in in_precision(tensors, None).values()} == {"f4"}
    rounded = in_precision({"a": np.array([0.1], np.float32)}, "half")["a"]
    assert rounded.tolist() == [struct.unpack("<e", struct.pack("<e", 0.1))[0]]


@pytest.mark.parametrize(
    ("value", "precision", "fine"),
    [
        (65472.0, "half", True),
        (65504.0, "half", False),
        (70_000.0, "half", False),
        (70_000.0, "single", True),
        (999_999.0, None, True),
        (1e6, None, False),
        (1e6, "single", False),
        (float("nan"), None, False),
        (float("-inf"), "half", False),
    ],
)
def test_numbers_have_a_bound(value: float, precision: str | None, fine: bool) -> None:
    tensors = {"w": np.array([0.0, value], np.float32)}
    if fine:
        assert in_precision(tensors, precision)["w"].tolist() == [0.0, value]
    else:
        with pytest.raises(FormatError, match="w holds numbers that are not finite or too large"):
            in_precision(tensors, precision)


def test_weights_of_either_precision_are_read_in_single() -> None:
    for kind in (np.float16, np.float32):
        found = in_single({"a": np.array([0.5], kind), "b": np.array([2.0], kind)})
        assert {array.dtype for array in found.values()} == {np.dtype(np.float32)}
        assert found["a"].tolist() == [0.5]
    mixed = {"a": np.ones(1, np.float16), "b": np.ones(1, np.float32)}
    for wrong in (mixed, {"a": np.ones(1)}, {"a": np.ones(1, np.int32)}, {}):
        with pytest.raises(ValueError, match="are not float32 or float16 numbers, all alike"):
            in_single(wrong)
    with pytest.raises(ValueError, match="a holds numbers"):
        in_single({"a": np.array([1e3], np.float32)}, 1e3)


def test_directions_are_of_unit_length_to_a_thousandth() -> None:
    unit = np.array([[0.6, 0.0, 0.8], [0.0, 1.0002, 0.0]])
    check_unit_vectors({"wi": unit, "wo": unit[:1]})
    for wrong in (1.002 * unit, unit[0], unit[:, :2], unit * np.nan, 0.0 * unit):
        with pytest.raises(ValueError, match=r"^wo (are no unit directions|holds numbers)"):
            check_unit_vectors({"wi": unit, "wo": wrong})


def test_a_block_makes_one_kind_of_error_of_all() -> None:
    def caught(error: Exception) -> str:
        with pytest.raises(FormatError) as found, format_errors("a.safetensors"):
            raise error
        return str(found.value)

    assert caught(KeyError("name")) == "a.safetensors: field 'name' is missing"
    for error in (TypeError("x"), AttributeError("x")):
        assert caught(error) == "a.safetensors: a field of its header has the wrong type"
    for error in (ValueError("no codes"), OverflowError("no codes"), RecursionError("no codes")):
        assert caught(error) == "a.safetensors: no codes"
    assert caught(FormatError("b: told already")) == "b: told already"


def test_files_of_ours_are_known_by_their_first_bytes(path: Path) -> None:
    head = path.read_bytes()
    assert looks_like_tensors(head)
    assert header_key(head) == KEY
    assert header_key(to_bytes("other", HEADER, TENSORS, 1 << 20)) is None
    assert not looks_like_tensors(head[:9])
    assert not looks_like_tensors(head[:8] + b"[" + head[9:])
    assert looks_like_tensors(struct.pack("<Q", (1 << 32) - 1) + head[8:])
    assert not looks_like_tensors(struct.pack("<Q", 1 << 32) + head[8:])


def test_a_header_is_looked_for_without_reading_the_tensors(path: Path, tmp_path: Path) -> None:
    assert has_header(path, KEY)
    assert not has_header(path, "nacre lamp")
    assert not has_header(tmp_path, KEY)
    assert not has_header(tmp_path / "absent", KEY)
    content = path.read_bytes()
    size = int.from_bytes(content[:8], "little")
    path.write_bytes(content[: 8 + size])
    assert has_header(path, KEY)
    path.write_bytes(struct.pack("<Q", len(content) + 1) + content[8:])
    assert not has_header(path, KEY)
    for text in (b"{}", b"[]", b'{"__metadata__":3}', b"{", b"[" * 100_000):
        path.write_bytes(struct.pack("<Q", len(text)) + text)
        assert not has_header(path, KEY)
