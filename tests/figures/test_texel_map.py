"""Where names go on a map."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from nacre.figures.code_views import map_figure
from nacre.figures.texel_map import apart, family, middle


def test_names_are_moved_apart_and_no_further() -> None:
    random = np.random.default_rng(2)
    centers = np.concatenate([random.uniform(40.0, 60.0, (20, 2)), [[350.0, 350.0], [1.0, 200.0]]])
    sizes = np.tile([30.0, 8.0], (22, 1))
    found = apart(centers, sizes, np.array([[0.0, 0.0], [400.0, 400.0]]))
    over = sizes - np.abs(found[:, None] - found)
    np.einsum("iik->ik", over)[:] = 0.0
    assert not (over > 0.01).all(axis=2).any()
    assert (found >= sizes / 2 - 0.01).all()
    assert (found <= 400.0 - sizes / 2 + 0.01).all()
    assert np.abs(found[20] - centers[20]).max() < 0.1
    np.testing.assert_allclose(found[21], [15.0, 200.0], atol=0.1)


def test_names_on_a_map_of_codes_do_not_cover_one_another() -> None:
    pytest.importorskip("matplotlib", reason="needs the extra 'plot'")
    random = np.random.default_rng(0)
    names = [f"material-{'x' * random.integers(3, 15)}-{k}" for k in range(40)]
    pictures = [np.full((8, 8, 3), 0.5)] * len(names)
    figure = map_figure(names, random.normal(size=(len(names), 2)), pictures, names[:1])
    figure.draw_without_rendering()
    boxes = [text.get_window_extent() for text in figure.texts]
    boxes += [axes.get_window_extent() for axes in figure.axes]
    assert len(boxes) == 80
    assert not any(a.overlaps(b) for a, b in itertools.combinations(boxes, 2))
    assert all(box.x0 >= 0.0 and box.x1 <= figure.bbox.x1 for box in boxes)


def test_a_name_goes_where_most_texels_are() -> None:
    random = np.random.default_rng(4)
    parts = [random.normal(0.0, 1.0, (30, 2)), random.normal(50.0, 9.0, (20, 2))]
    assert np.linalg.norm(middle(np.concatenate(parts))) < 2.0


def test_families_are_names_without_numbers() -> None:
    names = ("felt12", "felt_03", "felt-3", "felt", "12")
    assert [family(n) for n in names] == ["felt"] * 4 + ["12"]
