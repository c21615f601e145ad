"""Journals of trainings as the pages read them."""

from __future__ import annotations

import pytest

from nacre.textures.codecs.networks.journal import COLUMNS
from nacre_lab.reproduce.textures.trainings import Row, read_journal


def test_a_journal_is_read(tmp_path):
    path = tmp_path / "x.csv"
    path.write_text(f"{','.join(COLUMNS)}\n1,1.5,0.1,2,\n2,3,0.1,1,0.5\n3,4\n", encoding="utf-8")
    assert read_journal(path) == [Row(1, 1.5, 0.1, 2.0, None), Row(2, 3.0, 0.1, 1.0, 0.5)]


@pytest.mark.parametrize(
    "row", ["\u00b2,1,1,1,", '3,"' + "x" * 200_000 + '",1,1,', "9" * 5000 + ",1,1,1,"]
)
def test_a_journal_that_is_damaged_or_missing_has_no_rows(tmp_path, row):
    path = tmp_path / "x.csv"
    assert read_journal(path) == []
    path.write_text(f"{','.join(COLUMNS)}\n1,1,1,1,\n{row}\n", encoding="utf-8")
    assert read_journal(path) == []
    path.write_text("other,columns\n1,1\n", encoding="utf-8")
    assert read_journal(path) == []
