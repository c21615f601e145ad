"""The splits: what is judged is never learned from, and files are those that everybody has."""

from __future__ import annotations

from pathlib import Path

import pytest

import nacre
from nacre.download.databases import databases
from nacre.errors import NacreError
from nacre.included import names
from nacre.latent import find_basis
from nacre_lab.benchmark.splits import find_split, splits
from nacre_lab.reproduce.codes import split as split_of_table2
from nacre_lab.reproduce.unseen import seen_by
from tests.data import require_data


@pytest.mark.parametrize("name", splits())
def test_materials_exist_and_training_has_none_of_them(name: str) -> None:
    split = splits()[name]
    assert split.materials
    every = (*split.materials, *split.training)
    assert len(set(every)) == len(every)
    for material in every:
        if ":" in material:
            assert material in names()
        else:
            assert split.database is not None
            assert databases()[split.database].facts(material).sha256


def test_networks_of_merl_are_split_as_in_table_2() -> None:
    merl = [Path(name) for name in names() if name.startswith("merl:")]
    for seed in range(3):
        split = find_split(f"merl-networks-{seed}")
        training, held_out = split_of_table2(merl, seed)
        assert split.training == tuple(map(str, training))
        assert split.materials == tuple(map(str, held_out))


def test_the_included_basis_has_seen_nothing_of_the_default_split() -> None:
    paths = [find_split("included").path(name) for name in find_split("included").materials]
    assert seen_by(find_basis("neural"), paths) == []


def test_measured_files_must_be_there_and_the_right_ones(tmp_path: Path) -> None:
    split = find_split("rgl")
    with pytest.raises(NacreError, match="rgl paper_white' fetches it, and --measured"):
        split.path("paper_white")
    with pytest.raises(NacreError, match=r"has no paper_white_rgb\.bsdf; 'nacre download"):
        split.path("paper_white", tmp_path)
    (tmp_path / "paper_white_rgb.bsdf").write_bytes(b"another one")
    with pytest.raises(NacreError, match="is not the file that the benchmark uses"):
        split.path("paper_white", tmp_path)
    real = require_data("rgl", "paper_white_rgb.bsdf")
    assert split.path("paper_white", real.parent) == real


def test_unknown_names_are_listed() -> None:
    with pytest.raises(NacreError, match=r"'none' is not a split \(known: included, "):
        find_split("none")
    with pytest.raises(NacreError, match="'chrome' is not a material of the split rgl"):
        find_split("rgl").chosen(["chrome"])
    assert find_split("rgl").chosen(["satin_rosaline", "paper_white"]) == (
        "paper_white",
        "satin_rosaline",
    )
    assert isinstance(nacre.load(find_split("included").materials[0]), nacre.Brdf)
