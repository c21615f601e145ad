"""The video: what its pages show, and what is kept and told of it."""

from __future__ import annotations

import csv
from dataclasses import replace

import numpy as np
import pytest

from nacre.color import tone_map
from nacre_lab.reproduce import EXPERIMENTS
from nacre_lab.reproduce.tables import scaled
from nacre_lab.reproduce.textures import video
from nacre_lab.reproduce.textures.animation import animation
from nacre_lab.reproduce.textures.methods import find

TINY = replace(video.VIEW, size=16, spp=2, frames=3)


@pytest.fixture
def tiny(monkeypatch):
    pytest.importorskip("mitsuba", reason="needs the extra 'render'")
    monkeypatch.setattr(video, "VIEW", TINY)


def test_animations_of_measured_and_decoded_textures(tiny, study, tmp_path):
    from PIL import Image

    material = study.unseen[0]
    study = replace(study, unseen=[material], skipped={})
    methods = [find(name) for name in ("unified-4", "pca-4")]
    outcome = EXPERIMENTS["btf-video"].outcome("btf-video", study, methods)
    paths = outcome.write("btf-video", tmp_path)
    names = "btf-video.csv", "btf-video.md", "btf-video-felt12.webp"
    assert [path.name for path in paths] == list(names)
    with Image.open(paths[2]) as file:
        assert file.n_frames == 3
        assert file.width == round((2 * 2.12 + 0.12) * 128)  # of two columns
    with paths[0].open(newline="") as file:
        (row,) = csv.DictReader(file)
    assert (row["material"], row["method"]) == ("felt12", "unified-4")
    text = paths[1].read_text()
    assert f"| unified-4 | {scaled(float(row['mse']))} | {scaled(float(row['mse']))} |" in text
    assert "- pca-4: " in text
    assert "own directions only" in text

    with material.opened() as texture:
        truth = animation(texture, None, TINY, 0).astype(np.float64)
        decoded = animation(texture, study.codec(methods[0], material), TINY, 0)
    mse = np.square(truth - decoded).mean()
    assert float(row["mse"]) == pytest.approx(mse, rel=1e-3)
    assert truth.min() >= 0.0
    assert np.ptp(truth, axis=0).max() > 0.01  # the light moves

    calls = []
    study.progress = lambda *call: calls.append(call)
    again = EXPERIMENTS["btf-video"].outcome("btf-video", study, methods)
    assert again.rows == outcome.rows
    assert not any("rendering" in str(call) for call in calls)
    np.testing.assert_array_equal(again.animations["felt12"], outcome.animations["felt12"])


def test_pages_show_the_pictures_and_where_the_light_is():
    grays = 0.3, 0.15  # the first is brought to 0.6
    columns = [
        video.Column(f"gray {value:g}", "", "", np.full((4, 8, 8, 3), value)) for value in grays
    ]
    view = replace(video.VIEW, size=8, frames=4)
    pages = list(video.video_frames("felt", columns, view))
    height, width = pages[0].shape[:2]
    assert (width, height) == (round(4.36 * 128), round(3.28 * 128))
    for page in pages:
        for x, value in zip((0.12 + 1.0, 0.12 + 2.12 + 1.0), grays, strict=True):
            shown = page[round(1.52 * 128), round(x * 128)]
            np.testing.assert_array_equal(shown, np.rint(255 * tone_map(np.array(2 * value))))
    dials = [page[round(2.78 * 128) :, -round(0.5 * 128) :].mean(2) for page in pages]
    places = []
    for dial in dials:
        y, x = np.nonzero(dial < 100)
        places.append((x.mean() - 0.21 * 128, y.mean() - 0.25 * 128))
    x, y = np.transpose(places)
    middle = np.array([x.mean(), y.mean()])
    radii = np.hypot(*(np.transpose(places) - middle[:, None]))
    np.testing.assert_allclose(radii, radii[0], atol=1.0)  # pixels
    assert radii[0] > 5.0
    assert np.argmin(x + y) == 0  # at the upper left, where the light begins
