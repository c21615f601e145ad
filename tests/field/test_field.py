"""Each real file is read, and its values are checked somewhere, or is refused by name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.errors import FormatError
from nacre.geometry import join, uniform_hemisphere
from tests.data import require_data
from tests.field.files import REAL, Real
from tests.field.table import BEGIN, END, table

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "results" / "field.md"


def test_every_real_file_has_its_row():
    folder = require_data("field")
    there = {
        path.relative_to(folder).as_posix()
        for path in folder.rglob("*")
        if path.is_file() and path.name != "SOURCES.md"
    }
    assert [real.file for real in REAL] == sorted({real.file for real in REAL})
    assert {real.file for real in REAL} == there


@pytest.mark.parametrize("real", REAL, ids=lambda real: real.file)
def test_a_real_file_is_read_or_refused_by_name(real: Real):
    path = require_data("field", *real.file.split("/"))
    if real.refused:
        with pytest.raises(FormatError) as refusal:
            nacre.load(path)
        message = str(refusal.value)
        assert message.startswith(f"{path}: ")
        assert real.refused in message
        assert "\n" not in message
    if real.refused and not real.opaque_part:
        return
    material = nacre.load(path, opaque_part=True if real.opaque_part else None)
    assert bool(material.notes) >= real.opaque_part
    assert isinstance(material, nacre.Brdf)
    u = np.random.default_rng(0).uniform(size=(4, 64))
    values = material.eval(join(uniform_hemisphere(*u[:2])), join(uniform_hemisphere(*u[2:])))
    assert np.isfinite(values).all()
    assert values.max() > 0.0


def test_values_are_checked_by_tests_that_exist():
    read = [real for real in REAL if not real.refused]
    assert all(real.checked for real in read)
    assert all((ROOT / real.test).is_file() for real in read)


def test_the_page_has_the_table():
    folder = require_data("field")
    text = PAGE.read_text(encoding="utf-8")
    assert text[text.index(BEGIN) + len(BEGIN) : text.index(END)] == table(folder)
