"""Plausible materials: drawn, judged, brought back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from nacre.errors import NacreError
from nacre.latent import pretrained_basis, save_code
from nacre.latent.kinds import members
from nacre.metrics import albedo
from nacre.workflows import draw_materials, plausibility, project_material
from tests.latent.made import basis, random_basis


@pytest.mark.slow
def test_what_is_drawn_is_plausible_and_makes_no_light():
    known = pretrained_basis()
    found = draw_materials(known, 12, seed=1)
    again = draw_materials(known, 12, seed=1)
    level = known.prior.level()
    for material, same in zip(found, again, strict=True):
        np.testing.assert_array_equal(material.code, same.code)
        assert known.prior.log_density(material.code) >= level - 1e-3
        assert albedo(material, [0.0, 0.8, 1.3]).value.max() < 1.05  # by other points
    other = draw_materials(known, 1, seed=2)[0]
    assert np.abs(other.code - found[0].code).max() > 0.1


def test_metals_are_like_metals():
    known = pretrained_basis()
    metals = members(known, "metal")
    near = 0
    for material in draw_materials(known, 12, like="metal"):
        away = np.linalg.norm(known.examples - material.code, axis=1)
        near += int(away.argmin()) in metals
    assert near >= 9


def test_what_is_like_a_file_is_about_it(tmp_path):
    known = pretrained_basis()
    save_code(known.decode(known.examples[5]), tmp_path / "code.json")
    found = draw_materials(known, 6, like=str(tmp_path / "code.json"))
    assert found[0].name == "code 1"
    away = [np.linalg.norm(m.code - known.examples, axis=1).argmin() for m in found]
    assert away.count(5) >= 4


def test_what_is_like_an_included_material_is_named_after_it():
    found = draw_materials(pretrained_basis(), 1, like="rgl:paper_white")
    assert found[0].name == "rgl:paper_white 1"


def test_an_implausible_material_comes_back_and_a_plausible_one_stays():
    known = pretrained_basis()
    far = known.decode(4.0 * known.examples[2], "far")
    found = project_material(far)
    before, after = plausibility(far), plausibility(found)
    assert before.typical < 0.05
    assert after.log_density == pytest.approx(known.prior.level(), abs=0.05)
    assert after.typical == pytest.approx(0.05, abs=0.02)
    assert found.name == "far"
    np.testing.assert_array_equal(project_material(found).code, found.code)


def test_bases_that_know_too_little_are_refused():
    with pytest.raises(NacreError, match="'pca' does not know"):
        draw_materials(basis(), 1)
    alone = replace(random_basis(), examples=random_basis().examples[:1])
    with pytest.raises(NacreError, match="too few materials"):
        draw_materials(alone, 1)
