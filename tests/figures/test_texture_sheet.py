"""Sheets of textures: the whole of each is shown, and every pair once under its directions."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.btf import TableBtf
from nacre.figures.page import Page
from nacre.figures.texture_sheet import texture_sheet
from nacre.figures.texture_views import texture_panels
from nacre.measured.textures.directions import from_degrees

pytest.importorskip("matplotlib", reason="needs the extra 'plot'")

DEGREES = [(0.0, 0.0), (45.0, 22.5), (60.0, 270.0)]
DIRECTIONS = np.array([from_degrees(*angles) for angles in DEGREES], np.float32)
PURE = np.eye(3, dtype=np.float32)


def striped(height: int, width: int, count: int = 1) -> TableBtf:
    """Red at its start and green at its end along the longer edge, blue between."""
    along = np.indices((height, width))[int(width >= height)] * 8 // max(height, width)
    picture = PURE[np.select([along == 0, along == 7], [0, 1], 2)]
    values = np.repeat(picture[:, :, None], count, axis=2)
    return TableBtf(values, DIRECTIONS[:count], DIRECTIONS[count - 1 :: -1][:count], "striped")


def shown(sheet: np.ndarray) -> np.ndarray:
    """The first picture: what is in its box is of pure colors only."""
    pure = np.isin(sheet, (0, 255)).all(-1) & (sheet.sum(-1, dtype=int) == 255)
    rows, columns = np.flatnonzero(pure.any(1)), np.flatnonzero(pure.any(0))
    end = columns[np.append(np.diff(columns) > 1, True)][0]
    return sheet[rows[0] : rows[-1] + 1, columns[0] : end + 1]


@pytest.mark.parametrize(
    ("height", "width", "pixels"),
    [
        (1, 1, (384, 384)),
        (1, 8, (48, 384)),
        (4, 300, (4, 300)),
        (380, 30, (380, 30)),
        (30, 48, (240, 384)),
        (640, 1536, (160, 384)),
    ],
)
def test_the_whole_texture_is_shown_in_its_proportions(height, width, pixels):
    made = striped(height, width)
    picture = shown(texture_sheet(made, made))
    assert picture.shape[:2] == pixels
    np.testing.assert_array_equal(picture[0, 0], 255 * PURE[0])
    if max(height, width) > 1:
        np.testing.assert_array_equal(picture[-1, -1], 255 * PURE[1])


@pytest.mark.parametrize("count", [1, 2, 3])
def test_every_pair_is_shown_once_under_its_directions(monkeypatch, count):
    texts: list[str] = []
    monkeypatch.setattr(Page, "text", lambda page, x, y, text, *a, **k: texts.append(text))
    monkeypatch.setattr(Page, "text_width", lambda page, text: 0.0)
    made = striped(6, 6, count)
    sheet = texture_sheet(made, made, ("a", "b"))
    labels = [text for text in texts if text.startswith("Light: ")]
    theta = [f"theta {theta:g}°, phi {phi:g}°" for theta, phi in DEGREES[:count]]
    pairs = zip(theta, theta[::-1], strict=True)
    known = {f"Light: {light}        View: {view}" for light, view in pairs}
    assert sorted(labels) == sorted(set(labels))
    assert set(labels) <= known
    assert {"Reference", "Model", "Difference", "a", "b"} <= set(texts)
    assert "6 x 6 texels; every row has an exposure of its own" in texts
    assert sheet.shape[1] == 1280


def test_names_of_any_characters_can_be_written():
    made = striped(2, 2).replaced(name="two\nlines \0 \udcff" + "x" * 500)
    assert texture_panels(made, np.array([0]), 1).shape[2] == 3
    assert texture_sheet(made, made, (made.name, made.name)).shape[2] == 3


def test_what_is_reduced_says_so(monkeypatch):
    texts: list[str] = []
    monkeypatch.setattr(Page, "text", lambda page, x, y, text, *a, **k: texts.append(text))
    monkeypatch.setattr(Page, "text_width", lambda page, text: 0.0)
    made = striped(3, 1030)
    texture_sheet(made, made)
    assert "1,030 x 3 texels, 3 x 3 a pixel; every row has an exposure of its own" in texts


def test_panels_have_captions_and_each_its_picture(monkeypatch):
    texts: list[tuple[tuple[float, float], str]] = []
    monkeypatch.setattr(
        Page, "text", lambda page, x, y, text, *a, **k: texts.append(((x, y), text))
    )
    values = np.array([0.0, 0.25, 1.0], np.float32)[:, None] * np.ones((2, 3, 1, 3), np.float32)
    made = TableBtf(values, DIRECTIONS, DIRECTIONS[::-1], "three")
    sheet = texture_panels(made, np.array([2, 0, 1]), 2)
    assert texts[0][1] == "three"
    assert texts[1][1] == "3 x 2 texels; reflectance of 1 is white"
    for (at, light), (_, view), pair in zip(texts[2::2], texts[3::2], (2, 0, 1), strict=True):
        wanted = [DEGREES[k] for k in (pair, 2 - pair)]
        for text, (theta, phi) in zip((light, view), wanted, strict=True):
            assert text.endswith(f": theta {theta:g}°, phi {phi:g}°")
        top, left = round(160 * (at[1] + 0.24)), round(160 * at[0])
        below = sheet[top + 1 :, left + 1 :][:168, :253]
        grey = round(255 * values[0, 0, pair, 0] ** (1 / 2.2))
        np.testing.assert_allclose(below, grey, atol=1)
