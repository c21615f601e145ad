"""Safetensors files of codecs and of codes taken apart, damaged and put together again."""

from __future__ import annotations

import json
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import safetensors.numpy

from nacre.errors import FormatError
from nacre.textures.codecs.codec_file import load_codec
from tests.specimens import mutated

Tensors = dict[str, npt.NDArray[Any]]


def _header(path: Path) -> tuple[str, str]:
    """The entry of a file's metadata, but for the mark of who wrote it."""
    data = path.read_bytes()
    size = int.from_bytes(data[:8], "little")
    metadata = json.loads(data[8 : 8 + size])["__metadata__"]
    metadata.pop("written by", None)
    (entry,) = metadata.items()
    return entry


def header_and_tensors(path: Path) -> tuple[dict[str, Any], Tensors]:
    """What a file holds."""
    return json.loads(_header(path)[1]), safetensors.numpy.load(path.read_bytes())


def rewrite(path: Path, header: dict[str, Any], tensors: Tensors) -> None:
    """Put other content into a file, under the name that its header has."""
    safetensors.numpy.save_file(tensors, path, {_header(path)[0]: json.dumps(header)})


def rewrite_field(path: Path, place: tuple[str, ...], value: Any) -> None:
    """Change one field of the header, which may lie within others."""
    header, tensors = header_and_tensors(path)
    inside = header
    for key in place[:-1]:
        inside = inside[key]
    inside[place[-1]] = value
    rewrite(path, header, tensors)


def assert_codec_refused(path: Path, message: str) -> None:
    """One line that names the file and matches a pattern."""
    with pytest.raises(FormatError, match=message) as caught:
        load_codec(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def assert_missing_fields_are_named(path: Path) -> None:
    """Fields of the header; `values` is for people."""
    header, tensors = header_and_tensors(path)
    for key in header.keys() - {"values"}:
        rewrite(path, {k: v for k, v in header.items() if k != key}, tensors)
        assert_codec_refused(path, f"'{key}' is missing")
    rewrite(path, header, tensors)


def assert_damage_is_refused(path: Path) -> None:
    """Of a whole file: cut off, lengthened, with bytes changed, or of something else."""
    whole, random, errors = path.read_bytes(), Random(5), []
    for data in (b"", whole[:100], whole + b"x"):
        path.write_bytes(data)
        with pytest.raises(FormatError):
            load_codec(path)
    path.write_bytes(whole[:-1])
    assert_codec_refused(path, "not a whole safetensors file")
    for _ in range(60):
        path.write_bytes(mutated(whole, random))
        try:
            load_codec(path)
        except FormatError as error:
            errors.append(str(error))
    assert len(errors) > 20
    assert not any("\n" in error for error in errors)
    safetensors.numpy.save_file({"x": np.zeros(1, np.float32)}, path, {"nacre": "{}"})
    assert_codec_refused(path, "not a model of textures")
