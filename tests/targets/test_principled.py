"""The script that makes an asset of Blender's Principled node."""

from __future__ import annotations

import ast
import json
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import nacre.analytic
from nacre.analytic.lambert import Lambert
from nacre.color import tone_map
from nacre.mitsuba.lights import DirectionalLight
from nacre.mitsuba.sphere import render_sphere
from nacre.standard.principled import FilmPrincipled, Principled
from nacre.targets import TARGETS
from nacre.targets.blender_addon import reading
from tests.analytic.materials import EXAMPLES
from tests.oracles import blender, blender_addon
from tests.oracles.principled import socket
from tests.targets.support import needs

SIZE = 64
TERMS = "CC BY 4.0; cite the authors"


def written(brdf, name="paint"):
    ((file, source),) = TARGETS["principled"]().files(brdf, name).items()
    assert file == f"{name}.py"
    return source


def held(source: bytes) -> dict:
    """The material of a script."""
    for each in ast.parse(source).body:
        if isinstance(each, ast.Assign) and ast.unparse(each.targets[0]) == "MATERIAL":
            return json.loads(ast.literal_eval(each.value))
    raise AssertionError("no material")


@pytest.mark.parametrize("name", [name for name in EXAMPLES if name.startswith("principled")])
def test_a_principled_material_is_written_as_it_is(name):
    given = held(written(EXAMPLES[name]))
    values = {key: tuple(v) if isinstance(v, list) else v for key, v in given["parameters"].items()}
    assert given["model"] == name
    assert values == EXAMPLES[name].values
    assert reading.read(json.dumps(given), "x").model == name


def test_a_name_is_data():
    evil = '""" \\ {evil}\n\N{SNOWMAN}'
    values = EXAMPLES["principled"].values
    trees = []
    for text in (evil, "harmless"):
        source = written(Principled(name=text, source={"terms": text}, **values))
        assert held(source)["name"] == text
        _, *statements = ast.parse(source).body
        trees.append(
            [ast.unparse(each) for each in statements if "MATERIAL =" not in ast.unparse(each)]
        )
    assert trees[0] == trees[1]


@pytest.mark.slow
def test_any_other_material_is_fitted(monkeypatch):
    monkeypatch.setattr("nacre.analytic.fit", partial(nacre.analytic.fit, starts=3))
    given = held(written(Lambert(diffuse=(0.4, 0.2, 0.1), name="clay")))
    assert given["model"] == "principled"
    assert given["name"] == "clay"
    assert given["metadata"]["fit"]["views_psnr"] > 35.0


def test_blender_gets_the_values_once_and_renders_what_we_do(tmp_path: Path):
    needs(blender.missing())
    values = EXAMPLES["principled-film"].values
    brdf = FilmPrincipled(name="paint", source={"terms": TERMS}, **values)
    (tmp_path / "paint.py").write_bytes(written(brdf))
    found, picture = blender_addon.run("asset", tmp_path / "paint.py", SIZE)
    assert found["materials"] == ["mine", "paint"]
    assert found["added"].pop("materials") == 1
    assert not any(found["added"].values())
    assert found["other"] == [True, 0, []]
    for name, value in values.items():
        made = found["inputs"][socket(name)]
        expected = [*value, 1.0] if isinstance(value, tuple) else value
        np.testing.assert_allclose(made, expected, rtol=1e-6)
    assert found["distribution"] == "MULTI_GGX"
    assert found["nodes"].count("BSDF_PRINCIPLED") == 1
    assert "RGB" in found["nodes"]  # a user's node
    assert found["tags"] == ["nacre", brdf.model]
    assert found["license"] == TERMS
    assert TERMS in found["description"]
    assert found["thumbnail"] == [128, 128]
    assert found["shades"] > 1000
    picture_here, _ = render_sphere(brdf, DirectionalLight(), SIZE)
    assert np.abs(tone_map(picture) - tone_map(picture_here)).max() < 0.01
