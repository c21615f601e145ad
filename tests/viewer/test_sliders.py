"""The page of sliders in a browser."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nacre.figures.sliders import moved, slider_page
from nacre.latent.edits import Edit
from tests.latent.made import random_basis
from tests.viewer.tab import patient

pytest.importorskip("mitsuba", reason="needs the extra 'render'")


@pytest.mark.slow
def test_a_slider_chooses_among_pictures(chromium: Any, tmp_path: Path) -> None:
    basis = random_basis()
    still = np.zeros((6, 6))
    edit = Edit("<rougher>", "smoother", "Wider & wider.", np.eye(6)[0], still)
    row = moved(basis.decode(np.zeros(6), "m"), edit, 3)
    assert [material.name for material in row] == [
        "m <rougher> " + a for a in ("-2.00", "+0.00", "+2.00")
    ]
    np.testing.assert_allclose([material.code[0] for material in row], [-2.0, 0.0, 2.0])
    captions = {material.name: f'line "{index}"' for index, material in enumerate(row)}
    content = slider_page("a & b", [edit], [row], lambda m: captions[m.name], 16, 1)
    (tmp_path / "page.html").write_bytes(content)
    assert not re.search(rb"https?:", content)
    page = patient(chromium.new_context()).new_page()
    problems: list[str] = []
    page.on("console", lambda message: problems.append(message.text))
    page.on("pageerror", lambda error: problems.append(str(error)))
    page.goto((tmp_path / "page.html").as_uri())
    assert page.title() == "a & b"
    assert page.locator("h2").inner_text() == "<rougher>"
    assert page.locator("output").inner_text() == 'line "1"'
    slider = page.get_by_role("slider", name="<rougher>")
    slider.press("ArrowRight")
    assert page.locator("output").inner_text() == 'line "2"'
    place = "element => getComputedStyle(element).backgroundPositionX"
    assert page.locator(".picture").evaluate(place) == "-32px"
    assert slider.get_attribute("aria-valuetext") == 'line "2"'
    assert problems == []
    page.context.close()
