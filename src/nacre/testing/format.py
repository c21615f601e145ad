"""What every file format keeps."""

from __future__ import annotations

import functools
import os
import random
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import nacre.formats
from nacre.analytic import MODELS
from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.errors import FormatError
from nacre.formats import FORMATS
from nacre.io.files import PathLike
from nacre.io.format import HEAD, Format
from nacre.testing.cases import Checks, Contracts, pairs, refused

CONTRACTS = Contracts()
_CUTS, _DAMAGES = 24, 48


@dataclass(frozen=True)
class _Case:
    entry: Format
    contents: Sequence[bytes]  # of whole files
    material: Any  # what is written; None where the format is only read
    tolerance: float

    def file(self, folder: str, content: bytes) -> Path:
        path = Path(folder) / f"specimen{self.entry.extensions[0]}"
        path.write_bytes(content)
        return path


def check_format(
    entry: Format,
    files: Sequence[PathLike] = (),
    material: Any = None,
    tolerance: float = 0.02,
) -> Checks:
    """Contracts of a file format: whole files are read, and damage is refused in one line.

    Parameters
    ----------
    entry
        The format.
    files
        Whole files of it; needed where the format is only read.
    material
        What is written, where the format is written too; a glossy reflectance if None.
    tolerance
        Relative error of 90 % of the values of a material that was written and read; exact is 0.
    """
    return CONTRACTS.of(functools.partial(_case, entry, list(files), material, tolerance))


def _case(entry: Format, files: Sequence[PathLike], material: Any, tolerance: float) -> _Case:
    contents = [Path(file).read_bytes() for file in files]
    if entry.save is None:
        assert contents, "give files: the format is only read"
        return _Case(entry, contents, None, tolerance)
    if material is None:
        assert entry.kind == "brdf", "give a material to write"
        material = _glossy()
    with tempfile.TemporaryDirectory(prefix="nacre-testing-") as folder:
        path = Path(folder) / f"written{entry.extensions[0]}"
        entry.save(material, path)
        return _Case(entry, [*contents, path.read_bytes()], material, tolerance)


def _glossy() -> Brdf:
    return MODELS["ggx"](
        diffuse=(0.3, 0.2, 0.1), specular=(0.3, 0.3, 0.3), roughness=0.4, name="glossy"
    )


def _in_folder(function: Callable[[_Case, str], None]) -> Callable[[_Case], None]:
    @functools.wraps(function)
    def run(case: _Case) -> None:
        with tempfile.TemporaryDirectory(prefix="nacre-testing-") as folder:
            function(case, folder)

    return run


def _finite(material: Any) -> bool:
    """Whether a material has values, all finite, at random directions or texels."""
    if isinstance(material, Btf):
        values = material.texels(slice(0, 4))
    else:
        values = material.eval(*pairs(200))
    return bool(np.isfinite(values).all())


def _refused_or_harmless(case: _Case, path: Path) -> bool:
    """Whether a file is refused in one line that names it; otherwise its values must be finite."""
    try:
        found = case.entry.load(path)
        assert _finite(found), "a damaged file gives values that are not finite"
    except FormatError as error:
        text = str(error)
        assert "\n" not in text, f"the message is not one line: {text!r}"
        assert path.name in text, f"the message does not name the file: {text!r}"
        return True
    except AssertionError:
        raise
    except Exception as error:
        kind = type(error).__name__
        raise AssertionError(f"a damaged file raises {kind}, not FormatError: {error}") from error
    return False


@CONTRACTS.add
@_in_folder
def _whole_files_are_read(case: _Case, folder: str) -> None:
    for content in case.contents:
        found = case.entry.load(case.file(folder, content))
        assert isinstance(found, Btf if case.entry.kind == "btf" else Brdf)
        assert _finite(found)


@CONTRACTS.add
@_in_folder
def _the_first_bytes_or_the_ending_are_recognized(case: _Case, folder: str) -> None:
    if case.entry.recognize is not None:
        for content in case.contents:
            assert case.entry.recognize(content[:HEAD])
        assert not case.entry.recognize(b"")
        assert not case.entry.recognize(b"\x00" * HEAD)
    if FORMATS.get(case.entry.name) is case.entry:
        path = case.file(folder, case.contents[0])
        assert nacre.formats.identify(path) is case.entry


@CONTRACTS.add
@_in_folder
def _what_is_written_reads_back(case: _Case, folder: str) -> None:
    if case.entry.save is None:
        return
    path = Path(folder) / f"written{case.entry.extensions[0]}"
    case.entry.save(case.material, path)
    first = path.read_bytes()
    found = case.entry.load(path)
    again = Path(folder) / "again" / path.name  # files may hold their own name
    again.parent.mkdir()
    case.entry.save(case.material, again)
    assert again.read_bytes() == first, "the same material gives other bytes"
    if isinstance(case.material, Btf):
        values, expected = (m.texels(slice(None)) for m in (found, case.material))
    else:
        wi, wo = pairs(1000)
        values, expected = found.eval(wi, wo), case.material.eval(wi, wo)
    error = np.abs(values - expected) / (np.abs(expected) + 0.01 * np.abs(expected).mean())
    worst = float(np.quantile(error, 0.9))
    assert worst <= case.tolerance, f"values differ by {worst:.2g}"


@CONTRACTS.add
@_in_folder
def _a_file_cut_short_is_refused_or_harmless(case: _Case, folder: str) -> None:
    content = case.contents[0]
    lengths = np.unique(np.linspace(0, len(content) - 1, _CUTS).astype(int))
    states = [_refused_or_harmless(case, case.file(folder, content[:length])) for length in lengths]
    assert states[0], "an empty file is read"
    assert any(states[1:]), "a file is read however short it is cut"


@CONTRACTS.add
@_in_folder
def _damage_anywhere_is_refused_or_harmless(case: _Case, folder: str) -> None:
    draw = random.Random(11)
    for _ in range(_DAMAGES):
        damaged = bytearray(case.contents[0])
        for _ in range(draw.randint(1, 8)):
            damaged[draw.randrange(len(damaged))] = draw.randrange(256)
        _refused_or_harmless(case, case.file(folder, bytes(damaged)))


@CONTRACTS.add
@_in_folder
def _what_is_no_file_is_refused(case: _Case, folder: str) -> None:
    absent = Path(folder) / f"absent{case.entry.extensions[0]}"
    refused(FormatError, case.entry.load, absent, words="absent")
    other = case.file(folder, b"\xff\xfe nothing of this kind \x00" * 40)
    assert _refused_or_harmless(case, other), "bytes of no format are read"
    if hasattr(os, "mkfifo") and not case.entry.claims_folder:
        pipe = Path(folder) / f"pipe{case.entry.extensions[0]}"
        os.mkfifo(pipe)
        refused(FormatError, case.entry.load, pipe, words="pipe")


@CONTRACTS.add
@_in_folder
def _writing_elsewhere_leaves_nothing(case: _Case, folder: str) -> None:
    if case.entry.save is None:
        return
    path = Path(folder) / "absent" / f"written{case.entry.extensions[0]}"
    refused((FormatError, OSError), case.entry.save, case.material, path)
    assert not list(Path(folder).iterdir())
