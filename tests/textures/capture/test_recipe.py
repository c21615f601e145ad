"""Recipes: the built-in ones, and files that are none."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nacre.errors import FormatError
from nacre.textures.capture import Recipe, built_in, find
from nacre.textures.capture.generators import GENERATORS
from nacre.textures.capture.patterns import cells, fractal, lay_fibres, scattered
from tests.tiers import tiered


def test_twelve_of_each_family_and_the_last_is_unseen() -> None:
    recipes = built_in()
    assert Counter(r.generator.name for r in recipes) == dict.fromkeys(
        ("fabric", "leather", "wood", "stone", "felt", "carpet", "wallpaper"), 12
    )
    unseen = [r.name for r in recipes if r.unseen]
    assert unseen == [r.name for r in recipes if r.name.endswith("12")]
    assert len({json.dumps([r.seed, str(r.generator)]) for r in recipes}) == 84


@pytest.mark.parametrize(
    "name", tiered([r.name for r in built_in()], lambda name: name.endswith("1"))
)
def test_a_surface_tiles_and_is_made_again_alike(name: str) -> None:
    recipe = find(name)
    surface = recipe.build(64)
    assert np.array_equal(surface.height, recipe.build(64).height)
    assert abs(surface.height.mean()) < 1e-9
    assert 0.001 < np.ptp(surface.height) < 0.5
    for axis in (0, 1):  # steps across the seam are like those elsewhere
        steps = abs(surface.height - np.roll(surface.height, 1, axis)).mean(1 - axis)
        assert steps[0] <= 1.5 * steps[1:].max()


def test_materials_differ_in_color() -> None:
    """No two of a family have nearly the same mean albedo, specular color and roughness."""
    for first in range(0, 84, 12):
        surfaces = [recipe.build(48) for recipe in built_in()[first : first + 12]]
        means = np.array(
            [[*s.albedo.mean((0, 1)), *s.specular.mean((0, 1)), *s.roughness.mean((0, 1))]
             for s in surfaces]
        )  # fmt: skip
        apart = abs(means[:, None] - means).max(-1) + np.eye(12)
        assert apart.min() > 0.02


def test_patterns_are_the_same_at_every_size() -> None:
    fine, coarse = (fractal(np.random.default_rng(3), size, 4.0, 2) for size in (128, 64))
    assert fine[::2, ::2] == pytest.approx(coarse, abs=1e-9)
    points = scattered(np.random.default_rng(3), 6, 0.7)
    assert np.array_equal(cells(64, points).index[::2, ::2], cells(32, points).index)


def test_a_fibre_is_a_cylinder_over_the_seam() -> None:
    along = np.linspace(0.0, 1.0, 400, endpoint=False)
    points = np.stack([along, np.zeros(400), np.full(400, 0.5)], -1)
    heights, owner = lay_fibres(32, points, 0.1, np.full(400, 7))
    inside = np.array([0, 1, 2, 3, -3, -2, -1])
    expected = 0.5 + np.sqrt(0.01 - (inside / 32.0) ** 2)
    assert heights[inside] == pytest.approx(np.repeat(expected[:, None], 32, 1), abs=1e-4)
    assert set(owner[inside].ravel()) == {7}
    assert (owner[4:-3] == -1).all()


@pytest.mark.parametrize("name", tiered(GENERATORS, lambda name: name != "fabric"))
def test_every_parameter_may_be_at_its_bounds(name: str) -> None:
    """Each alone at its least, and all together; a surface checks itself."""
    family = GENERATORS[name]
    bounds = {f.name: f.metadata for f in fields(family) if "low" in f.metadata}
    given = [{key: m["low"]} for key, m in bounds.items()]
    given += [{key: m[end] for key, m in bounds.items()} for end in ("low", "high")]
    for parameters in given:
        Recipe("x", family.from_json(parameters)).build(32)


def test_planks_may_touch() -> None:
    """Without a gap, as with one that is too narrow for any cell's corner but those in it."""
    wide, none = ({"planks": 3, "gap": gap} for gap in (1e-9, 0.0))
    surfaces = [Recipe("x", GENERATORS["wood"].from_json(p)).build(32) for p in (wide, none)]
    inside = abs(np.arange(32) * 3 / 32 % 1.0 - 0.5) < 0.49
    first, second = (s.albedo[:, inside] for s in surfaces)
    assert np.array_equal(first, second)
    assert surfaces[1].albedo[:, 0].mean() > 2.0 * surfaces[0].albedo[:, 0].mean()


def write(path: Path, content: Any) -> Path:
    path.write_text(content if isinstance(content, str) else json.dumps(content))
    return path


def test_a_file_is_a_recipe(tmp_path: Path) -> None:
    path = write(tmp_path / "mine.json", {"family": "fabric", "parameters": {"strands": 10}})
    recipe = find(path)
    assert (recipe.name, recipe.seed, recipe.unseen) == ("mine", 0, False)
    assert recipe.build(32).size == 32
    before = {"family": "stone", "parameters": {"vein_colour": ["#123456"]}}
    assert find(write(tmp_path / "old.json", before)).generator.vein_color == ("#123456",)
    copied = {"family": "stone", "seed": 12, "parameters": {}}
    assert not find(write(tmp_path / "stone12.json", copied)).unseen


@pytest.mark.parametrize(
    ("content", "field"),
    [
        ("{", "JSON"),
        ("[" * 9000, "JSON"),
        ('{"family": "fabric", "seed": ' + "9" * 5000 + "}", "JSON"),
        ([], "object"),
        ({}, "family"),
        ({"family": "silk"}, "family"),
        ({"family": ["fabric"]}, "family"),
        ({"family": "fabric", "seed": -1}, "seed"),
        ({"family": "fabric", "seed": 1.5}, "seed"),
        ({"family": "fabric", "sed": 1}, "sed"),
        ({"family": "fabric", "parameters": []}, "parameters"),
        ({"family": "fabric", "parameters": {"colour": 1}}, "colour"),
        ({"family": "fabric", "parameters": {"strands": 1000}}, "strands"),
        ({"family": "fabric", "parameters": {"strands": 8.0}}, "strands"),
        ({"family": "fabric", "parameters": {"strands": True}}, "strands"),
        ({"family": "fabric", "parameters": {"weave": "twill", "strands": 6}}, "strands"),
        ({"family": "fabric", "parameters": {"warp": ["#000000"] * 3}}, "strands"),
        ({"family": "fabric", "parameters": {"weave": "knit"}}, "weave"),
        ({"family": "fabric", "parameters": {"weave": []}}, "weave"),
        ({"family": "fabric", "parameters": {"warp": []}}, "warp"),
        ({"family": "fabric", "parameters": {"warp": ["red"]}}, "warp"),
        ({"family": "fabric", "parameters": {"warp": ["#00000g"]}}, "warp"),
        ({"family": "stone", "parameters": {"vein_color": ["#000000"] * 2}}, "list of 1 color"),
        ({"family": "leather", "parameters": {"roughness": 0.1}}, "roughness"),
        ({"family": "leather", "parameters": {"roughness": "rough"}}, "roughness"),
        ('{"family": "leather", "parameters": {"depth": NaN}}', "depth"),
    ],
)
def test_what_is_no_recipe_is_named(tmp_path: Path, content: Any, field: str) -> None:
    path = write(tmp_path / "bad.json", content)
    with pytest.raises(FormatError, match=field) as error:
        find(path)
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


def test_an_unknown_name_is_no_file(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="fabric99: is neither a built-in recipe"):
        find("fabric99")
    with pytest.raises(FormatError, match="no such file"):
        find(tmp_path / "absent.json")


def test_the_docs_have_every_parameter(tmp_path: Path) -> None:
    """Names, defaults and ranges of the tables, in the order of the code."""
    page = Path(__file__).parents[3] / "docs" / "reference" / "surface-recipes.md"
    text = page.read_text("utf-8")
    head, *parts = text.split("\n## ")
    (tmp_path / "x.json").write_text(head.split("```")[1])
    assert find(tmp_path / "x.json").seed == 7
    assert [part.split()[0] for part in parts] == list(GENERATORS)
    for part, family in zip(parts, GENERATORS.values(), strict=True):
        rows = [line.split(" | ") for line in part.splitlines() if line.startswith("| `")]
        for row, field in zip(rows, fields(family), strict=True):
            name, default, allowed, _ = (cell.strip("| ") for cell in row)
            rule, standard = field.metadata, field.default
            assert name == f"`{field.name}`"
            if "options" in rule:
                wanted = f"`{standard}`", ", ".join(f"`{word}`" for word in rule["options"])
            elif "colors" in rule:
                most = rule["colors"]
                count = f"1 to {most} colors" if most > 1 else "1 color"
                wanted = " ".join(f"`{c}`" for c in standard), count
            else:
                whole = ", whole" if rule.get("whole") else ""
                wanted = f"{standard:g}", f"{rule['low']:g} to {rule['high']:g}{whole}"
            assert (default, allowed) == wanted
