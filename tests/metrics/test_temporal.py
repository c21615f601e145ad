"""Errors over time, and pictures of errors."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.errors import NacreError
from nacre.figures.difference_sheet import difference, panels_size, rendering_panels
from nacre.figures.page import Page, magma, scale_end
from nacre.metrics.temporal import temporal_errors


def test_figures_are_those_of_the_whole_animation() -> None:
    random = np.random.default_rng(3)
    truth, other = random.uniform(-0.2, 1.3, (2, 9, 5, 4, 3))
    found = temporal_errors(zip(truth, other, strict=True))
    truth, other = np.clip(truth, 0, 1), np.clip(other, 0, 1)
    error = other - truth
    assert found.mse == pytest.approx(np.mean(error**2))
    assert found.variance == pytest.approx(np.var(error, axis=0).mean())
    for value, animation in (
        (found.truth_steps, truth),
        (found.other_steps, other),
        (found.error_steps, error),
    ):
        assert value == pytest.approx(np.square(np.diff(animation, axis=0)).mean())


def test_an_error_that_stands_still_does_not_flicker() -> None:
    truth = np.linspace(0.2, 0.5, 4)[:, None, None, None] * np.ones((4, 2, 2, 3))
    found = temporal_errors(zip(truth, truth + 0.1, strict=True))
    assert found.mse == pytest.approx(0.01)
    assert max(found.variance, found.error_steps) < 1e-12
    assert found.truth_steps == pytest.approx(found.other_steps) == pytest.approx(0.01)


def test_one_frame_and_none() -> None:
    found = temporal_errors([(np.zeros((1, 1, 3)), np.full((1, 1, 3), 0.5))])
    assert (found.mse, found.variance, found.error_steps) == (0.25, 0.0, 0.0)
    with pytest.raises(NacreError, match="no frame"):
        temporal_errors([])


def test_panels_show_both_renderings_and_one_scale_for_all_frames(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    texts: list[str] = []
    monkeypatch.setattr(Page, "text", lambda page, x, y, text, *a, **k: texts.append(text))
    monkeypatch.setattr(Page, "text_width", lambda page, text: 0.0)
    truths = [np.full((64, 64, 3), value, np.float32) for value in (0.0, 0.6)]
    others = [truths[0] + 0.03, truths[1] - [0.0, 0.3, 0.1]]
    pages = list(rendering_panels(truths, others, ("a", "b"), "figures"))
    width, height = panels_size(64)
    assert [page.shape for page in pages] == [(height, width, 3)] * 2
    assert texts[:5] == ["Reference", "Model", "Difference", "a", "b"]
    assert "figures" in texts
    assert "Difference: the largest of the channels; white is 1, colors end at 0.5" in texts
    scale = scale_end([difference(truths[1], others[1])])
    assert scale == 0.5
    for page, truth, other, error in zip(pages, truths, others, (0.03, 0.3), strict=True):
        middles = [page[400, 40 + 192 + 408 * column] / 255 for column in range(3)]
        wanted = truth[0, 0] ** (1 / 2.2), other[0, 0] ** (1 / 2.2), magma(np.array(error / scale))
        np.testing.assert_allclose(middles, wanted, atol=0.003)


@pytest.mark.parametrize("size", [1, 24, 150, 256, 300])
def test_the_size_of_panels_is_known_before(size: int) -> None:
    picture = np.zeros((size, size, 3), np.float32)
    (page,) = rendering_panels([picture], [picture])
    assert page.shape[1::-1] == panels_size(size)
