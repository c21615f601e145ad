"""Tables and figures of a small study."""

from __future__ import annotations

import csv
import itertools
import math
from dataclasses import fields, replace

import numpy as np
import pytest

from lab.tests.reproduce.support import SETTINGS, Gray, small_methods, write_materials
from nacre.analytic import MODELS
from nacre.figures.plot import MAX_MATERIALS
from nacre_lab.reproduce import EXPERIMENTS
from nacre_lab.reproduce.cache import Cache
from nacre_lab.reproduce.chart import place_labels
from nacre_lab.reproduce.codes import CodeSettings
from nacre_lab.reproduce.experiment import Request
from nacre_lab.reproduce.lobes import lobe_errors
from nacre_lab.reproduce.methods import methods
from nacre_lab.reproduce.representations import Comparison
from nacre_lab.reproduce.study import run
from nacre_lab.reproduce.summary import markdown, readable, summarize
from nacre_lab.reproduce.trial import FIGURES, Settings, Trial

figures = pytest.importorskip("matplotlib.figure", reason="needs the extra 'plot'")
pytest.importorskip("skimage", reason="needs the extra 'render'")


COMPARISONS = {name: kind for name, kind in EXPERIMENTS.items() if isinstance(kind, Comparison)}
STAGES = {
    "table3": {f"{name}, {stage}" for name in "ab" for stage in ("timing", "counting rays")},
    "fig8": {"lobes"},
}
"""Of what takes a while after the trials."""


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    known = small_methods(Gray(refuse=True))
    found = run(write_materials(folder), known, SETTINGS, Cache(folder / "cache"))
    shared = {each.name: getattr(SETTINGS, each.name) for each in fields(SETTINGS)}
    return replace(found, settings=CodeSettings(**shared, held_out=("b",)))


@pytest.mark.parametrize("name", COMPARISONS)
def test_every_experiment_writes_its_files(study, tmp_path, name):
    stages, shown = set(), ["gray", "nbrdf-675"]
    outcome = COMPARISONS[name].outcome(name, study, shown, lambda stage, *_: stages.add(stage))
    paths = outcome.write(name, tmp_path)
    assert stages == STAGES.get(name, set())
    assert set(paths) == set(tmp_path.iterdir())
    assert (len(paths) == 2) == name.startswith("table")
    for path in paths[2:]:
        assert path.read_bytes().startswith(b"\x89PNG")
    rows = list(csv.reader(paths[0].read_text(encoding="utf-8").splitlines()))
    assert [row[:2] for row in rows[1:]] == [["a", "gray"], ["a", "nbrdf-675"], ["b", "nbrdf-675"]]
    assert all(len(row) == len(rows[0]) for row in rows)
    text = paths[1].read_text(encoding="utf-8")
    assert "**Differs from the paper:** " in text
    assert "- gray: not for b (b)" in text
    assert "16 pixels wide" in text
    assert "**Materials:** a, b (nacre neural material)" in text


def test_experiments_choose_methods_that_exist():
    known = methods(Settings())
    for name, kind in COMPARISONS.items():
        chosen = kind.choose(known)
        assert chosen, name
        assert set(chosen) <= set(known) - {"truth"}
    compared = COMPARISONS["table1"].choose([*known, "a new one"])
    assert {"nbrdf-675", "nbrdf-675-uniform", "a new one", *MODELS} <= set(compared)
    assert not {"nbrdf-105", "texture-network-2019"} & set(compared)
    assert "nbrdf-105" in COMPARISONS["fig17"].choose(known)


def trial(material: str, value: float) -> Trial:
    return Trial(material, "x", 12, 0.5, dict.fromkeys(FIGURES, value))


def test_a_plot_has_room_for_the_lobes_of_all_methods_that_fig8_chooses():
    chosen = COMPARISONS["fig8"].choose(methods(Settings()))
    assert 1 < len(chosen) < MAX_MATERIALS  # the truth is another


def test_summaries_have_mean_deviation_and_worst():
    trials = [trial("a", 1.0), trial("b", 2.0), trial("c", 6.0)]
    error = summarize(trials, "environment MAE")
    assert (error.mean, error.worst, error.material) == (3.0, 6.0, "c")
    assert error.deviation == pytest.approx(math.sqrt(14.0 / 3.0))
    quality = summarize(trials, "environment SSIM")
    assert (quality.worst, quality.material) == (1.0, "a")


def test_equal_pictures_have_no_spread_of_psnr():
    item = summarize([trial("a", math.inf), trial("b", 30.0)], "directional PSNR")
    assert (readable(item.mean, "PSNR"), readable(item.deviation, "PSNR")) == ("∞", "–")
    assert (item.worst, item.material) == (30.0, "b")


def test_markdown_counts_materials(study):
    lines = markdown(study, ["gray", "nbrdf-675"], ["environment SSIM"], "environment").splitlines()
    assert lines[0] == "| method | bytes | materials | SSIM |"
    assert lines[2].startswith("| gray | 12 | 1 |")
    assert lines[3].startswith("| nbrdf-675 | 3,264 | 2 |")
    assert lines[3].endswith(("(a) |", "(b) |"))


def test_lobe_errors_are_decades():
    bright, dim = (MODELS["lambert"](diffuse=(x, x, x)) for x in (0.5, 0.05))
    assert lobe_errors(bright, dim) == pytest.approx([1.0] * 4)
    assert lobe_errors(bright, bright) == [0.0] * 4


def test_labels_do_not_cover_each_other():
    figure = figures.Figure((5.0, 4.0))
    axes = figure.add_axes((0.1, 0.1, 0.8, 0.8))
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(0.0, 1.0)
    random = np.random.default_rng(0)
    points = 0.4 + 0.1 * random.random((12, 2))
    place_labels(axes, points, [f"method {k}" for k in range(12)])
    figure.draw_without_rendering()
    text_alone = pytest.importorskip(
        "matplotlib.text", reason="needs the extra 'plot'"
    ).Text.get_window_extent
    boxes = [text_alone(text) for text in axes.texts]  # without their lines
    overlaps = [a.overlaps(b) for a, b in itertools.combinations(boxes, 2)]
    assert len(boxes) == 12
    assert not any(overlaps)


def test_every_experiment_of_both_papers_is_registered_and_heeds_known_options():
    names = {f.name for f in fields(Request)}
    assert {"table1", "fig6", "fig11", "fig13", "btf-table1", "btf-tsne"} <= set(EXPERIMENTS)
    for kind in EXPERIMENTS.values():
        assert kind.title
        assert kind.differs
        assert kind.heeds <= names
