"""The results file: only added to, whole lines only, nobody's file lost."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from nacre.errors import FormatError, NacreError
from nacre.io.outputs import overwrite
from nacre_lab.benchmark.results import Row, open_results, read_results
from nacre_lab.benchmark.table import markdown

ROW = Row("rgl", "a", "ggx", "k1", protocol={"name": "full"}, measures={"size_bytes": 28})


def test_rows_come_back_and_the_last_of_several_counts(tmp_path: Path) -> None:
    path = tmp_path / "r.jsonl"
    with open_results(path) as results:
        results.keep(ROW)
        results.keep(replace(ROW, material="b", key="k2", measures={"size_bytes": None}))
        results.keep(replace(ROW, key="k3", measures={"size_bytes": 30}))
    assert len(path.read_text().splitlines()) == 3
    newest, other = sorted(read_results(path), key=lambda row: row.material)
    assert (newest.key, newest.measures) == ("k3", {"size_bytes": 30})
    assert other.measures == {"size_bytes": None}
    with open_results(path) as results:
        assert results.find("k3") == newest
        assert results.find("k1") is None
    with open_results(path, fresh=True) as results:
        assert results.find("k3") is None


@pytest.mark.parametrize("cut", [1, 40, 200])
def test_a_line_that_was_cut_short_costs_itself_only(tmp_path: Path, cut: int) -> None:
    path = tmp_path / "r.jsonl"
    with open_results(path) as results:
        results.keep(ROW)
        results.keep(replace(ROW, key="k2", material="b"))
    path.write_bytes(path.read_bytes()[:-cut])
    with open_results(path) as results:
        results.keep(replace(ROW, key="k4", material="c"))
    expected = ["a", "b", "c"] if cut == 1 else ["a", "c"]
    assert [row.material for row in read_results(path)] == expected


@pytest.mark.parametrize("content", ['{"mine": 1}\n', "notes\n", "\0\0\0", "[]"])
def test_another_file_is_refused_and_stays(tmp_path: Path, content: str) -> None:
    path = tmp_path / "r.jsonl"
    path.write_text(content)
    with pytest.raises(FormatError, match="use --force to replace it"), open_results(path):
        pass
    with pytest.raises(FormatError, match="holds no results of nacre bench"):
        read_results(path)
    assert path.read_text() == content
    with overwrite(), open_results(path) as results:
        results.keep(ROW)
    assert [row.key for row in read_results(path)] == ["k1"]


def test_links_folders_and_a_second_process_are_refused(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(tmp_path / "r.jsonl")
    with pytest.raises(FormatError, match="symbolic link"), open_results(tmp_path / "link"):
        pass
    with pytest.raises(FormatError, match="is a directory"), open_results(tmp_path):
        pass
    with pytest.raises(FormatError, match="does not exist"), open_results(tmp_path / "no" / "r"):
        pass
    first = open_results(tmp_path / "r.jsonl")
    with (
        first,
        pytest.raises(NacreError, match="another nacre bench is adding to it"),
        open_results(tmp_path / "r.jsonl"),
    ):
        pass


@pytest.mark.parametrize(
    ("name", "value"),
    [("measures", {"noise": "low"}), ("measures", None), ("split", 3), ("unavailable", 1)],
)
def test_a_line_of_wrong_types_is_passed_over(tmp_path: Path, name: str, value: object) -> None:
    path = tmp_path / "r.jsonl"
    with open_results(path) as results:
        results.keep(ROW)
    wrong = json.loads(path.read_text()) | {"method": "sgd", name: value}
    path.write_text(path.read_text() + json.dumps(wrong) + "\n")
    assert [row.method for row in read_results(path)] == ["ggx"]


def test_tables_have_means_the_largest_albedo_and_dashes() -> None:
    def row(material: str, method: str, **measures: float | None) -> Row:
        known = {"size_bytes": 28.0, "noise": None, "max_albedo": None, **measures}
        return replace(ROW, material=material, method=method, measures=known)

    rows = [
        row("a", "ggx", environment_psnr_db=40.0, max_albedo=0.5),
        row("b", "ggx", environment_psnr_db=30.0, max_albedo=1.25, noise=0.125),
        row("a", "table", size_bytes=4000.0),
        replace(ROW, material="b", method="table", measures={}, unavailable="is anisotropic"),
    ]
    shown = "size_bytes", "environment_psnr_db", "noise", "max_albedo"
    assert markdown(rows, shown) == (
        "## rgl, protocol full, 2 materials\n\n"
        "| method | materials | bytes | environment PSNR | noise | largest albedo |\n"
        "| --- | ---: | ---: | ---: | ---: | ---: |\n"
        "| `ggx` | 2 | 28 | 35.0 | 0.125 (1) | 1.250 |\n"
        "| `table` | 1 | 4,000 | – | – | – |\n\n"
        "Without a result:\n\n"
        "- `table`: is anisotropic (b)\n"
    )
