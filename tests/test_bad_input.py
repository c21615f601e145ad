"""Damaged and impossible files of every format: refused in one line, in bounded memory.

Each test runs on every entry of :data:`tests.specimens.SPECIMENS`. What is special to one format
is tested beside its reader.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path
from random import Random

import numpy as np
import pytest

import nacre
from nacre import formats
from nacre.btf import Btf
from nacre.errors import FormatError
from nacre.io.format import Format
from tests.fuzz.target import Target, target
from tests.specimens import SPECIMENS, file_formats, mutated
from tests.tiers import tiered

ENTRIES = {entry.name: entry for entry in file_formats()}
SIZES = (0, -1, 2**31 - 1, 2**31, 2**32 - 1, 2**62, 2**63, 2**64 - 1)
CUTS = 40
"""How many places behind the header a file is cut at."""


@pytest.fixture(params=ENTRIES)
def case(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Target]:
    entry = ENTRIES[request.param]
    specimen = SPECIMENS[entry.name]
    if specimen.module:
        pytest.importorskip(specimen.module, reason=f"needs {specimen.module}")
    with target(entry, specimen, tmp_path) as made:
        yield made


def test_every_format_has_specimens() -> None:
    assert set(ENTRIES) == set(SPECIMENS)
    for name, specimen in SPECIMENS.items():
        assert Path(specimen.name).suffix in ENTRIES[name].extensions


def test_specimens_are_whole(case: Target) -> None:
    for content in case.specimen.files():
        assert case.check(content)
        found = nacre.load(case.path)
        assert isinstance(found, Btf) == (case.entry.kind == "btf")
        assert len(found.source["sha256"]) == 64


def test_a_file_cut_short_is_refused(case: Target) -> None:
    content = case.specimen.files()[0]
    later = np.linspace(case.specimen.header, len(content) - 1, CUTS).astype(int)
    for length in [*range(case.specimen.header), *later]:
        if case.specimen.text:
            case.check(content[:length])  # whole lines may be a shorter file
        else:
            assert not case.check(content[:length]), f"{length} of {len(content)} bytes"


@pytest.mark.parametrize("size", tiered(SIZES, [0, 2**31, 2**64 - 1]))
def test_a_count_that_is_not_true_is_refused(case: Target, size: int) -> None:
    for index, content in enumerate(case.specimen.sized(size)):
        assert not case.check(content), f"place {index}"


@pytest.mark.parametrize("size", tiered([1, 2, 5, 7], [1]))
def test_a_count_that_is_a_little_off_is_refused_or_harmless(case: Target, size: int) -> None:
    for content in case.specimen.sized(size):
        case.check(content)


@pytest.mark.parametrize("value", tiered([math.inf, -math.inf, math.nan], [math.inf]))
def test_a_value_that_is_not_finite_is_refused(case: Target, value: float) -> None:
    for index, content in enumerate(case.specimen.valued(value)):
        assert not case.check(content), f"place {index}"


@pytest.mark.parametrize(
    "value", tiered([1e300, -1e300, 3.4e38, -3.4e38, 1e30, 1e-45, -1.0], [-3.4e38])
)
def test_an_extreme_value_is_refused_or_gives_finite_ones(case: Target, value: float) -> None:
    with np.errstate(over="ignore"):
        for content in case.specimen.valued(value):
            case.check(content)


def test_trailing_bytes_are_refused_or_change_nothing(case: Target) -> None:
    content = case.specimen.files()[0]
    case.path.write_bytes(content)
    expected = case.entry.load(case.path).describe()
    for extra in (b"\0", b"\n", b"\0" * 8, b"x" * 100, content):
        if case.check(content + extra) and not case.specimen.text:
            assert case.entry.load(case.path).describe() == expected


@pytest.mark.parametrize("rounds", tiered([3, 12], [3]))
def test_damage_anywhere_is_refused_or_harmless(case: Target, rounds: int) -> None:
    random = Random(1)
    contents = case.specimen.files()
    for _ in range(rounds):
        case.check(mutated(random.choice(contents), random))
        case.check(case.specimen.rebuild(random.choice(contents), random))


@pytest.mark.parametrize(
    ("encoding", "readable"),
    tiered(
        [("utf-32", False), ("cp500", False), ("utf-16", True), ("latin-1", True)],
        [("cp500", False), ("utf-16", True)],
    ),
)
def test_text_of_another_encoding_is_refused_or_harmless(
    case: Target, encoding: str, readable: bool
) -> None:
    text = case.specimen.files()[0].decode("ascii") if case.specimen.text else "# theta_i: 1,2\n"
    read = case.check(text.encode(encoding) + "# é\n".encode(encoding))
    assert readable or not read


def test_files_of_other_formats_are_refused_or_harmless(case: Target) -> None:
    for name, other in SPECIMENS.items():
        if name != case.entry.name:
            case.check(other.files()[0])


def refused(case: Target, path: Path, *words: str) -> None:
    for read in (case.entry.load, nacre.load):
        with pytest.raises(FormatError) as caught:
            read(path)
        assert "\n" not in str(caught.value)
        assert path.name.partition("_")[0] in str(caught.value)
        assert any(word in str(caught.value) for word in words), str(caught.value)


def test_what_is_no_file_is_refused(case: Target) -> None:
    folder = case.path.with_name(f"folder{case.specimen.name}")
    folder.mkdir()
    refused(case, folder, "directory", "directions.csv: no such file")
    case.path.write_bytes(b"")
    refused(case, case.path, "is empty")
    case.path.unlink()
    refused(case, case.path, "no such file", "expected a name like", "not an NBRDF network")


def test_a_file_that_may_not_be_read_is_refused(
    case: Target, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(13, "Permission denied")

    case.path.write_bytes(case.specimen.files()[0])
    monkeypatch.setattr(Path, "open", refuse)
    monkeypatch.setattr(Path, "read_bytes", refuse)
    refused(case, case.path, "Permission denied")


def test_a_file_that_vanishes_is_refused(case: Target, monkeypatch: pytest.MonkeyPatch) -> None:
    """After it was recognized."""
    case.path.write_bytes(case.specimen.files()[0])
    entry = formats.identify(case.path)
    monkeypatch.setattr(formats, "_content", lambda path: nullcontext((path, b"")))
    monkeypatch.setattr(formats, "_of_file", lambda *_: entry)
    case.path.unlink()
    with pytest.raises(FormatError, match=r"no such file|not an NBRDF network"):
        nacre.load(case.path)


def test_a_pipe_is_refused_at_once(case: Target) -> None:
    case.path.unlink(missing_ok=True)
    os.mkfifo(case.path)
    refused(case, case.path, "is not a regular file", "not an NBRDF network")


# The fuzz targets run in seconds too


def test_a_target_keeps_one_input_of_a_kind_that_fails(tmp_path: Path) -> None:
    def load(path: Path) -> None:
        raise ValueError(path.read_bytes()[:1])

    (tmp_path / "work").mkdir()
    entry = Format("broken", (".csv",), None, load)
    broken = Target(entry, SPECIMENS["comma-separated samples"], tmp_path, tmp_path / "work")
    for data in (b"one", b"two"):
        broken(data)
    kept = sorted(p.name for p in tmp_path.glob("failure-*"))
    assert len(kept) == 2
    assert (tmp_path / kept[0]).read_bytes() == b"one"
    assert "ValueError: b'o'" in (tmp_path / kept[1]).read_text()
    assert broken.figures.executed == 2
    with pytest.raises(ValueError, match="b'o'"):
        broken.check(b"one")
