"""Trials: what they measure, and that a run goes on where it was stopped."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import nacre
from lab.tests.reproduce.support import SETTINGS, Gray, small_methods, write_materials
from nacre.errors import FormatError, NacreError
from nacre.metrics import compare
from nacre_lab.reproduce.cache import Cache
from nacre_lab.reproduce.study import run
from nacre_lab.reproduce.trial import FIGURES

pytest.importorskip("skimage", reason="needs the extra 'render'")


@pytest.fixture
def files(tmp_path):
    return write_materials(tmp_path)


def test_figures_are_those_of_compare(files, tmp_path):
    study = run(files, small_methods(Gray()), SETTINGS, Cache(tmp_path / "cache"))
    material = nacre.load(files[0])
    expected = compare(material, Gray()(material), size=16, directions=16)
    figures = study.trials["a", "gray"].figures
    assert set(figures) == set(FIGURES)
    for light in expected.lights:
        for measure in ("ssim", "psnr", "mae", "rmse", "flip"):
            found = figures[f"{light.light} {measure.upper()}"]
            assert found == pytest.approx(getattr(light.errors, measure), rel=1e-6)
    assert figures["angular relative error"] == expected.angles.relative_median
    assert figures["log-cosine error"] == expected.angles.log_cosine
    picture = study.pictures("a", "gray")["environment"]
    assert picture.shown.shape == (16, 16, 3)
    inner = picture.similarity[3:-3, 3:-3].astype(float)  # where windows lie in the frame
    assert inner.mean() == pytest.approx(figures["environment SSIM"], abs=1e-3)


def test_a_material_is_its_own_equal(files, tmp_path):
    study = run(files, small_methods(Gray()), SETTINGS, Cache(tmp_path / "cache"))
    figures = study.trials["b", "truth"].figures
    assert figures["environment SSIM"] == 1.0
    assert figures["directional PSNR"] == np.inf
    assert figures["angular relative error"] == 0.0


def test_a_stopped_run_goes_on(files, tmp_path):
    cache, stopped, again = Cache(tmp_path / "cache"), Gray(stop_after=1), Gray()
    with pytest.raises(KeyboardInterrupt):
        run(files, small_methods(stopped), SETTINGS, cache, jobs=1)
    first = run(files, small_methods(again), SETTINGS, cache, jobs=1)
    assert again.fits == 1  # of b; that of a was kept
    second = run(files, small_methods(again), SETTINGS, cache)
    assert again.fits == 1
    assert second.trials == first.trials


def test_what_changes_a_trial_makes_it_anew(files, tmp_path):
    cache, gray = Cache(tmp_path / "cache"), Gray()
    run(files, small_methods(gray), SETTINGS, cache)
    run(files, small_methods(gray, albedo=0.6), SETTINGS, cache)
    run(files, small_methods(gray), replace(SETTINGS, size=17), cache)
    run(files, small_methods(gray), SETTINGS, Cache(cache.folder, fresh=True))
    assert gray.fits == 8
    files[0].write_bytes(files[1].read_bytes())  # other content under the name: a is b now
    study = run(files, small_methods(gray), SETTINGS, cache)
    assert gray.fits == 9
    a, b = (study.trials[name, "gray"] for name in ("a", "b"))
    assert (a.material, b.material, a.figures) == ("a", "b", b.figures)


@pytest.mark.parametrize("damage", [b"", b"{}", b"PK\x03\x04 not a picture"])
def test_damaged_trials_are_made_again(files, tmp_path, damage):
    cache, gray = Cache(tmp_path / "cache"), Gray()
    first = run(files, small_methods(gray), SETTINGS, cache)
    path = cache.path(first.keys["a", "gray"])
    path.write_bytes(damage)
    second = run(files, small_methods(gray), SETTINGS, cache)
    assert gray.fits == 3
    assert second.trials["a", "gray"].figures == first.trials["a", "gray"].figures
    assert second.pictures("a", "gray")["directional"].mask.any()


def test_representations_are_kept_or_fitted_again(files, tmp_path):
    cache, gray = Cache(tmp_path / "cache"), Gray()
    study = run(files, small_methods(gray), SETTINGS, cache)
    assert study.fitted("a", "gray").values == Gray()(None).values
    assert gray.fits == 2
    assert not cache.path(study.keys["a", "truth"], ".safetensors").exists()
    cache.path(study.keys["a", "gray"], ".json").unlink()
    assert study.fitted("a", "gray").values == Gray()(None).values
    assert gray.fits == 3


def test_methods_without_a_representation_are_left_out(files, tmp_path):
    calls = []
    study = run(
        files,
        small_methods(Gray(refuse=True)),
        SETTINGS,
        Cache(tmp_path / "cache"),
        progress=lambda *call: calls.append(call),
    )
    assert study.skipped == {("b", "gray"): "not for b"}
    assert [trial.material for trial in study.of("gray")] == ["a"]
    assert calls[-1][1:3] == (6, 6)


def test_materials_that_cannot_be_tried_are_refused(files, tmp_path):
    cache = Cache(tmp_path / "cache")
    with pytest.raises(NacreError, match="two materials have the same file name"):
        run([files[0], tmp_path / "x" / "a.bsdf"], small_methods(Gray()), SETTINGS, cache)
    files[1].write_bytes(files[1].read_bytes()[:-9])
    with pytest.raises(FormatError, match=r"b\.safetensors: is not a whole"):
        run(files, small_methods(Gray()), SETTINGS, cache)
