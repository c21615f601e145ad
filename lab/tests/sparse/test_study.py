"""The study of peers on tiny data: tables of one's own, what is skipped, and what is kept."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from lab.studies.ablations import sparse_peers as study
from nacre import analytic, save
from nacre.measured.merl import Resolution
from nacre.measured.merl_table import MerlBrdf
from nacre.mitsuba.studio import studio
from nacre_lab.sparse import choices
from nacre_lab.sparse.set_encoder import SetEncoder, shapes
from tests.latent.made import random_basis

pytest.importorskip("torch")


def random_encoder():
    first, hyper = shapes()
    count = sum((n + 1) * m for layers in (first, *hyper) for n, m in layers)
    weights = np.random.default_rng(3).normal(0.0, 0.1, count).astype(np.float32)
    return SetEncoder.from_weights(weights, MerlBrdf(np.full((3, 5, 5, 5), 200.0, np.float32)))


@pytest.fixture
def run(tmp_path, monkeypatch):
    encoder = random_encoder()
    monkeypatch.setattr(study, "bases", lambda *_: {"neural": random_basis()})
    monkeypatch.setattr(study, "set_encoder", lambda *_: encoder)
    monkeypatch.setattr(study, "museum", studio)
    monkeypatch.setattr(choices, "DRAWS", 64)
    monkeypatch.setattr(choices, "LOOKED_AT", 8)

    def main(*words):
        out = ["-o", str(tmp_path / "out")]
        monkeypatch.setattr(sys, "argv", ["sparse_peers", *out, *map(str, words)])
        study.main()
        return (tmp_path / "out" / "sparse_peers-tables-seed-0.csv").read_text().splitlines()

    return main


@pytest.mark.slow
def test_tables_of_a_folder_are_judged(run, tmp_path, capsys, monkeypatch):
    folder = tmp_path / "tables"
    folder.mkdir()
    glossy = analytic.Ggx(diffuse=(0.1, 0.2, 0.3), specular=(0.9, 0.5, 0.2), roughness=0.3)
    save(glossy, folder / "glossy.binary", resolution=Resolution(18, 9, 9))
    (folder / "notes.txt").write_text("no table\n")
    words = "--quick", "--counts", "3", "--measured", folder
    rows = run(*words)
    assert "skipped: " in capsys.readouterr().err
    taken = {(row.split(",")[1], row.split(",")[2]) for row in rows[1:]}
    assert taken == {(name, maker) for name in study.CHOICES for maker in ("nacre", "set encoder")}
    for name in ("planned", "by_regression", "through_encoder", "render_sphere"):
        monkeypatch.setattr(study, name, None)  # all is kept
    assert run(*words) == rows
    assert run(*words, "--without-encoder")[1:] == [row for row in rows[1:] if "encoder" not in row]


def test_a_folder_without_tables_is_refused(run, tmp_path):
    (tmp_path / "notes.txt").write_text("no table\n")
    with pytest.raises(SystemExit, match="no isotropic material"):
        run("--measured", tmp_path)
    with pytest.raises(SystemExit, match="is not a folder"):
        run("--measured", tmp_path / "absent")
