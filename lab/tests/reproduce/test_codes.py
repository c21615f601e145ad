"""Table 2: what is held out, and bases that are trained once."""

from __future__ import annotations

from csv import DictReader

import numpy as np
import pytest

import nacre
from nacre.errors import NacreError
from nacre.runtime.progress import silent
from nacre_lab.reproduce import EXPERIMENTS
from nacre_lab.reproduce.cache import Cache
from nacre_lab.reproduce.codes import CODES, CodeSettings, code_methods, split
from nacre_lab.reproduce.methods import methods
from nacre_lab.reproduce.study import run
from nacre_lab.reproduce.trial import TRUTH
from tests.latent.made import material

pytest.importorskip("torch", reason="needs the extra 'latent'")
pytest.importorskip("skimage", reason="needs the extra 'render'")

SETTINGS = CodeSettings(size=16, directions=16, code_dim=4, steps=3, mixtures=2)


@pytest.fixture
def files(tmp_path):
    paths = [tmp_path / f"m{seed}.json" for seed in range(6)]
    for seed, path in enumerate(paths):
        nacre.save(material(seed), path)
    return paths


def prepare(files, names, folder, settings=SETTINGS, fresh=False):
    """Methods, settings, and the stages that were reported."""
    stages = []
    found = code_methods(
        files, names, settings, Cache(folder, fresh=fresh), lambda stage, *_: stages.append(stage)
    )
    return *found, stages


def test_a_fifth_is_held_out_whatever_the_order(files):
    training, held_out = split(files * 5, 3)
    assert len(held_out) == 6
    assert sorted(training + held_out) == sorted(files * 5)
    assert split(files[::-1], 0) == split(files, 0)
    assert len({tuple(split(files, seed)[1]) for seed in range(20)}) > 1


def test_every_code_is_tried_on_materials_seen_and_held_out(files, tmp_path):
    codes, settings, _ = prepare(files, list(CODES), tmp_path / "cache")
    assert settings.trained == 5
    (held_out,) = settings.held_out
    truth = methods(settings)[TRUTH]
    study = run(files, {TRUTH: truth, **codes}, settings, Cache(tmp_path / "cache"))
    assert not study.skipped
    assert len({study.of(name)[0].figures["environment MAE"] for name in CODES}) == len(CODES)
    bases = [nacre.latent.file.load_basis(p) for p in (tmp_path / "cache").glob("basis-*")]
    assert len(bases) == 4
    for basis in bases:
        assert basis.code_dim == 4
        assert len(basis.metadata["materials"]) == 5
        assert nacre.load(tmp_path / f"{held_out}.json").name not in basis.metadata["materials"]
    (tmp_path / "out").mkdir()
    outcome = EXPERIMENTS["table2"].outcome("table2", study, list(CODES), silent)
    csv, path = outcome.write("table2", tmp_path / "out")
    with csv.open(encoding="utf-8", newline="") as file:
        rows = [row for row in DictReader(file) if row["method"] == "neural"]
    assert [row["material"] for row in rows if row["materials"] == "held out"] == [held_out]
    text = path.read_text(encoding="utf-8")
    assert f"**Held out:** {held_out}." in text
    assert "bases of the 5 materials that are not held out" in text
    assert "| the paper's NBRDF autoencoder | – | all | 0.0178 ± 0.013 |" in text
    lines = [line.split(" | ") for line in text.splitlines() if line.startswith("| neural ")]
    means = {line[2]: float(line[3].partition(" ")[0]) for line in lines[:3]}
    assert means == {
        label: pytest.approx(np.mean([float(row["environment MAE"]) for row in part]), abs=6e-5)
        for label, part in (
            ("all", rows),
            ("seen", [row for row in rows if row["materials"] == "seen"]),
            ("held out", [row for row in rows if row["materials"] == "held out"]),
        )
    }


def test_bases_are_trained_once(files, tmp_path):
    folder = tmp_path / "cache"
    *_, stages = prepare(files, ["neural"], folder)
    assert "neural, training" in stages
    (path,) = folder.iterdir()
    first = path.read_bytes()
    *_, stages = prepare(files, ["neural"], folder)
    assert not stages
    *_, stages = prepare(files, ["hypernetwork"], folder)
    assert {stage.partition(",")[0] for stage in stages} == {"hypernetwork"}
    path.write_bytes(first[:-1])
    *_, stages = prepare(files, ["neural"], folder)
    assert stages
    *_, stages = prepare(files, ["neural"], folder, fresh=True)
    assert stages
    assert path.read_bytes() == first
    prepare(files, ["neural"], folder, CodeSettings(code_dim=4, steps=4))
    assert len(list(folder.iterdir())) == 3


def test_too_few_and_equal_names_are_refused(files, tmp_path):
    with pytest.raises(NacreError, match="table2 takes at least 5 materials, got 4"):
        prepare(files[:4], ["neural"], tmp_path)
    with pytest.raises(NacreError, match="same file name"):
        prepare([*files, files[0]], ["neural"], tmp_path)
