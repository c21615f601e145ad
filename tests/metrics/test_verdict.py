"""Verdicts: their thresholds are color differences, their words say what was crossed."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nacre.metrics.verdict import DISTINCT, NOTICED, UNSEEN, psnr_words, verdict


def test_thresholds_are_the_flip_of_color_differences():
    color = pytest.importorskip("skimage.color", reason="needs the extra 'render'")
    from nacre.metrics.ldr_flip import flip

    random = np.random.default_rng(0)
    hues = np.radians(np.arange(0.0, 360.0, 60.0))
    base = [
        (a, c * math.cos(h), c * math.sin(h))
        for a in (30, 50, 70)
        for c in (0, 20, 40)
        for h in hues
    ]

    def even(lab: np.ndarray) -> np.ndarray:
        return np.tile(color.lab2rgb(lab[None, None]), (8, 8, 1))

    for difference, expected in ((1.0, UNSEEN), (2.3, NOTICED), (5.0, DISTINCT)):
        steps = random.normal(size=(len(base), 3))
        steps *= difference / np.linalg.norm(steps, axis=1, keepdims=True)
        found = [
            flip(even(np.asarray(lab)), even(np.asarray(lab) + step)).mean()
            for lab, step in zip(base, steps, strict=True)
        ]
        assert np.median(found) == pytest.approx(expected, rel=0.2)


@pytest.mark.parametrize(
    ("most", "part", "words"),
    [
        (0.0, 0.0, "The pictures are equal: FLIP 0"),
        (
            0.03,
            0.09,
            "would hardly tell them apart: FLIP 0.036 (below 0.05), 0.090 in the worst 5 % ",
        ),
        (
            0.03,
            0.12,
            "who looks closely would see small differences: FLIP 0.120 in the worst 5 % (",
        ),
        (0.06, 0.09, "who looks closely would see small differences: FLIP 0.063 (above 0.05)"),
        (0.06, 0.3, "would see that they differ: FLIP 0.300 in the worst 5 % (above 0.17)"),
        (0.12, 0.12, "would see that they differ: FLIP 0.120 (above 0.1)"),
        (0.4, 0.4, "would take them for different materials: FLIP 0.400 (above 0.17)"),
    ],
)
def test_words_say_what_was_crossed(most, part, words):
    errors = np.full(100, most)
    errors[:10] = part
    found = verdict([("sphere", errors)])
    assert words in str(found)
    assert found.alike == ("hardly" in words or "equal" in words)


def test_the_picture_that_differs_most_decides():
    found = verdict([("first", np.full(9, 0.01)), ("second", np.full(9, 0.3)), ("x", np.zeros(9))])
    assert (found.picture, found.level) == ("second", 3)
    facts = found.facts()
    assert facts["text"] == str(found)
    assert (facts["flip"], facts["flip_threshold"], facts["flip_p95_threshold"]) == (0.3, 0.05, 0.1)
    with pytest.raises(ValueError, match="max"):
        verdict([])


def test_psnr_has_words():
    assert psnr_words(42.0) == "you can hardly see a difference (above 40 dB)"
    assert psnr_words(40.0) == "you can see a difference (below 40 dB)"
