"""Lobe plots: what the lines hold, and files that are the same each time."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from nacre.errors import FormatError, MissingExtraError, NacreError
from nacre.figures.lobes import lobe
from nacre.figures.plot import MAX_MATERIALS, check_plot_path, lobe_figure, write_plot
from tests.mitsuba.reflectances import Constant, Lobe

pytest.importorskip("matplotlib", reason="needs the extra 'plot'")


class Unknown(Constant):
    """Known nowhere."""

    def valid_components(self, wi, wo):
        return wi[2] > 2.0


class Cone(Constant):
    """Known for viewers within 40 degrees of the normal."""

    def valid_components(self, wi, wo):
        return wo[2] > math.cos(math.radians(40.0))


def curves(axes):
    """Lines of materials: those above the grid, in the order they are drawn."""
    return [line for line in axes.lines if line.get_zorder() == 2]


def test_radii_are_the_logarithm_between_centre_and_rim():
    figure = lobe_figure({"lobe": Lobe(200.0)}, [0.5], floor=0.01)
    (line,) = curves(figure.axes[0])
    x, y = line.get_xdata(), line.get_ydata()
    item = lobe(Lobe(200.0), 0.5)
    f = 0.2126 * item.rgb[:, 0] + 0.7152 * item.rgb[:, 1]
    radius, seen = np.hypot(x, y), f > 0.011
    np.testing.assert_allclose(np.arctan2(x, y)[seen], item.theta[seen], atol=1e-6)
    slope = (np.log10(f[seen]) + 2.0) / radius[seen]
    np.testing.assert_allclose(slope, slope[0], rtol=1e-5)
    assert (radius[f < 0.01] == 0.0).all()
    assert 0.95 < radius.max() < 1.0


def test_panels_are_channels_by_angles_and_lines_are_materials():
    materials = {"a": Lobe(50.0), "b": Constant(0.3), "c": Constant(0.1)}
    figure = lobe_figure(materials, [0.1, 0.8], channel="rgb")
    assert len(figure.axes) == 6
    for axes in figure.axes:
        assert [line.get_color() for line in curves(axes)] == ["#a3a6ab", "#0072B2", "#D55E00"]
    assert all((line.get_ydata() == 0).all() for line in curves(figure.axes[5])[:1])


def test_what_is_not_known_is_not_drawn():
    figure = lobe_figure({"cone": Cone(0.5)}, [0.2])
    (line,) = curves(figure.axes[0])
    drawn = np.isfinite(line.get_ydata())
    angles = np.degrees(np.arctan2(line.get_xdata()[drawn], line.get_ydata()[drawn]))
    assert 39.9 < np.abs(angles).max() < 40.0
    assert (~drawn).sum() > 80


def test_the_cosine_bends_a_diffuse_circle():
    (line,) = curves(lobe_figure({"grey": Constant(0.5)}, [0.2], cosine=True).axes[0])
    assert line.get_ydata()[np.abs(line.get_xdata()).argmax()] > 0.1


def test_long_keys_take_more_rows_and_names_are_no_formulas():
    names = [f"$x_{k}$ {'MATERIAL' * 12} {k}" for k in range(MAX_MATERIALS)]
    figure = lobe_figure({name: Constant(0.1) for name in names}, [0.2])
    texts = [text for text in figure.texts if text.get_text().startswith("$x_")]
    assert len(texts) == MAX_MATERIALS
    assert all("…" in text.get_text() for text in texts)
    assert [text.get_text()[-1] for text in texts] == [name[-1] for name in names]
    figure.canvas.draw()
    boxes = [text.get_window_extent() for text in texts]
    for k, box in enumerate(boxes):
        assert box.x1 < figure.bbox.x1
        assert box.y0 > max(axes.bbox.y1 for axes in figure.axes) - 20
        assert not any(box.overlaps(other) for other in boxes[k + 1 :])


@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_the_same_plot_gives_the_same_file(tmp_path, ending):
    for name in "ab":
        write_plot(lobe_figure({"lobe <&>": Lobe(50.0)}, [0.5]), tmp_path / f"{name}.{ending}")
    first, second = ((tmp_path / f"{name}.{ending}").read_bytes() for name in "ab")
    assert first == second
    assert len(first) > 3000
    assert b"CreationDate" not in first
    assert b"<dc:date>" not in first
    if ending == "svg":
        ElementTree.fromstring(first)


def test_the_note_says_what_is_drawn_and_fits():
    materials = {"lobe": Lobe(50.0)}
    figure = lobe_figure(materials, [0.2], azimuth=0.5, channel="green", cosine=True, floor=0.02)
    figure.canvas.draw()
    (note,) = [text for text in figure.texts if text.get_text().startswith("f_r")]
    words = note.get_text().replace("\n", " ")
    for part in ("f_r × cosine", "green", "1/sr", "0.02 and less at the center", "azimuth 28."):
        assert part in words
    assert note.get_window_extent().x1 < figure.bbox.x1
    assert note.get_window_extent().y1 < figure.axes[0].bbox.y1


def test_bad_targets_and_arguments_are_refused(tmp_path):
    with pytest.raises(FormatError, match=r"a plot ends in one of \.png, \.svg, \.pdf"):
        check_plot_path(tmp_path / "x.jpg")
    figure = lobe_figure({"grey": Constant(0.5)}, [0.2])
    with pytest.raises(FormatError, match="does not exist"):
        write_plot(figure, tmp_path / "absent" / "x.png")
    many = {str(k): Constant(0.5) for k in range(MAX_MATERIALS + 1)}
    for materials in ({}, many):
        with pytest.raises(NacreError, match="1 to 7 materials"):
            lobe_figure(materials)
    with pytest.raises(NacreError, match="nothing to plot"):
        lobe_figure({"nothing": Unknown(0.5)})
    for wrong in ({"channel": "hue"}, {"floor": 0.0}, {"incidence": []}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            lobe_figure({"grey": Constant(0.5)}, **wrong)


def test_black_has_a_plot():
    lobe_figure({"black": Constant(0.0)})


def test_the_missing_extra_is_named(monkeypatch, tmp_path):
    monkeypatch.setitem(__import__("sys").modules, "matplotlib.figure", None)
    with pytest.raises(MissingExtraError, match=r"nacre-materials\[plot\]"):
        check_plot_path(tmp_path / "x.png")
