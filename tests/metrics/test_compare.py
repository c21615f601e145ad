"""Comparisons and their picture."""

from __future__ import annotations

import math
import subprocess
import sys

import numpy as np
import pytest

from nacre.figures import picture
from nacre.figures.difference_sheet import Row
from nacre.figures.page import magma, scale_end
from nacre.metrics import Comparison, compare
from nacre.metrics.comparison import plausible_views
from nacre.metrics.ldr_flip import flip
from nacre.mitsuba.lights import DirectionalLight
from tests.mitsuba.reflectances import Constant, Lobe

pytest.importorskip("skimage", reason="needs the extra 'render'")


@pytest.fixture(scope="module")
def comparison() -> Comparison:
    """White against a glossy lobe, small."""
    return compare(Constant(1.0), Lobe(60.0), size=24, directions=64)


def test01_both_lights_and_all_figures(comparison: Comparison):
    assert [item.light for item in comparison.lights] == ["environment", "directional"]
    assert (comparison.truth, comparison.other) == ("constant", "Lobe")
    for item in comparison.lights:
        assert item.truth.shape == item.other.shape == (24, 24, 3)
        assert item.flip_map.shape == comparison.mask.shape == (24, 24)
        assert 0.0 < item.errors.flip < 1.0
    rows = comparison.rows()
    assert len(rows) == 14
    assert len({row[:2] for row in rows}) == 14
    assert {row[0] for row in rows} == {"environment", "directional", "angles"}
    assert all(math.isfinite(row[2]) for row in rows)


def test02_a_material_equals_itself():
    same = compare(Constant(1.0), Constant(1.0), size=16, directions=16)
    for item in same.lights:
        assert item.errors.psnr == math.inf
        assert item.errors.ssim == pytest.approx(1.0)
    assert same.angles.log_cosine == 0.0
    assert picture(same).dtype == np.uint8


def test03_progress_rises_to_one():
    seen: list[float] = []
    compare(Constant(1.0), Constant(1.0), size=64, directions=64, progress=seen.append)
    assert len(seen) > 4
    assert seen == sorted(seen)
    assert seen[-1] == pytest.approx(1.0)


def test04_picture_shows_spheres_on_paper(comparison: Comparison):
    image = picture(comparison)
    height, width, channels = image.shape
    assert channels == 3
    assert width == 1280  # 8 inches
    assert 1000 < height < 1200
    paper = image[2, 2]
    np.testing.assert_array_equal(paper, image[-3, -3])
    # The middle of the first sphere: white under the environment, tone mapped.
    item = comparison.lights[0]
    expected = np.clip(item.truth[12, 12], 0.0, 1.0) ** (1.0 / 2.2) * 255.0
    top, left = round(160 * (0.95 + 0.34)), 40
    np.testing.assert_allclose(image[top + 192, left + 192], expected, atol=6)
    corner = image[top : top + 384, left : left + 384][:8, :8]
    np.testing.assert_array_equal(corner, np.broadcast_to(paper, corner.shape))


def test04b_the_sphere_has_a_smooth_rim(comparison: Comparison):
    """Of the pixels along a row through the rim, some are partly covered, in steps."""
    image = picture(comparison)[round(160 * 1.29) :, 40:][:384, :384].astype(float)
    distance = np.hypot(*(np.indices((384, 384)) - 191.5))
    rim = 192.0 * 0.97
    spread = [np.ptp(image[abs(distance - r) < 0.3], axis=0).max() for r in (rim - 3.0, rim + 3.0)]
    assert spread[1] == 0.0
    partly = image[abs(distance - rim) < 0.5]
    inside, outside = image[abs(distance - rim + 3.0) < 0.3].mean(0), image[0, 0]
    covered = (partly - outside).mean(1) / (inside - outside).mean()
    assert 0.2 < covered.mean() < 0.8
    assert len(np.unique(covered.round(1))) > 5


def test04c_shadows_are_drawn_smoothly_and_measured_as_they_are(monkeypatch):
    """The sheet smooths what it draws; figures, maps and pictures of the comparison stay."""
    from nacre.figures import comparison_sheet
    from nacre.metrics.metrics import image_errors
    from nacre.mitsuba.sphere import render_sphere

    drawn: list[Row] = []
    monkeypatch.setattr(
        comparison_sheet, "difference_sheet", lambda rows, *_: drawn.extend(rows) or np.zeros(3)
    )
    materials = Constant(1.0), Lobe(60.0)
    found = compare(*materials, size=48, directions=16)
    before = [(item.truth.copy(), item.other.copy()) for item in found.lights]
    picture(found)
    for item, row, pair in zip(found.lights, drawn, before, strict=True):
        for image, kept, brdf in zip((item.truth, item.other), pair, materials, strict=True):
            np.testing.assert_array_equal(image, kept)
            np.testing.assert_array_equal(image, render_sphere(brdf, item.source, 48)[0])
        errors, flip_map = image_errors(item.truth, item.other, found.mask)
        assert errors == item.errors
        np.testing.assert_array_equal(row.error, flip_map)
        smoothed = [
            np.abs(a - b).max() for a, b in zip((row.reference, row.model), pair, strict=True)
        ]
        assert [change > 0.05 for change in smoothed] == [item.light == "directional"] * 2


def test04d_scales_are_a_few_fixed_steps():
    steps = [scale_end([np.full(9, error)]) for error in (0.0, 0.049, 0.051, 0.3, 0.9, 40.0)]
    assert steps == [0.05, 0.05, 0.1, 0.5, 1.0, 10.0]


def test04e_what_is_plausible_is_compared_as_it_is_displayed():
    """Intervals of few pictures that differ much reach below 0; FLIP takes what is displayed."""
    others = [Constant(0.01), Constant(1.0), Constant(50.0)]
    views = plausible_views(Constant(0.5), others, DirectionalLight(), 16)
    assert views.low.min() == 0.0
    assert views.high.max() > 1.0
    shown = (np.clip(image, 0.0, 1.0) ** (1.0 / 2.2) for image in (views.low, views.high))
    np.testing.assert_allclose(views.flip_map, flip(*shown), atol=1e-6)
    assert 0.5 < views.flip_map.max() <= 1.0


def test05_long_names_fit(comparison: Comparison):
    import dataclasses

    long = dataclasses.replace(comparison, truth="a material " * 40, other="a network " * 40)
    assert picture(long).shape == picture(comparison).shape


def test06_colors_are_those_of_flip():
    flip_evaluator = pytest.importorskip("flip_evaluator", reason="has no wheel here")

    black, red = np.zeros((24, 24, 3), np.float32), np.zeros((24, 24, 3), np.float32)
    red[..., 0] = np.linspace(0.0, 1.0, 24)
    errors, _, _ = flip_evaluator.evaluate(black, red, "LDR", applyMagma=False)
    colors, _, _ = flip_evaluator.evaluate(black, red, "LDR", applyMagma=True)
    np.testing.assert_allclose(magma(errors[..., 0]), colors, atol=0.03)


def test07_import_is_light():
    code = (
        "import sys, nacre.metrics, nacre.metrics.comparison; "
        "print([m for m in ('mitsuba', 'skimage', 'PIL') if m in sys.modules])"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert result.stdout.strip() == "[]"


def test08_unknown_names_are_refused():
    import nacre.metrics

    with pytest.raises(AttributeError, match="nonsense"):
        _ = nacre.metrics.nonsense
