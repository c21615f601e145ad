"""Blender's add-on and scripts: their source, what they refuse, and what Cycles makes of them."""

from __future__ import annotations

import ast
import contextlib
import io
import json
import sys
import tomllib
import zipfile
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

from nacre.analytic import MODELS
from nacre.analytic.file import encode
from nacre.brdf import Brdf
from nacre.color import tone_map
from nacre.mitsuba.lights import DirectionalLight
from nacre.mitsuba.sphere import render_sphere
from nacre.standard import closures
from nacre.standard.closures import Closures
from nacre.targets import TARGETS
from nacre.targets.blender import ADDON, addon, extension
from nacre.targets.blender_addon import reading
from tests.analytic.materials import EXAMPLES
from tests.oracles import blender, blender_addon
from tests.specimens.specimen import odd_json
from tests.targets.support import needs

SIZE = 64
MODULE = "nacre_blender.py"
TERMS = 'CC0 """ \\ {evil} \n\N{SNOWMAN}'


def mixture(seed: int, **settings: Any) -> Closures:
    """Some mixture; no lobe is bent away from the viewer."""
    random = np.random.default_rng(seed)
    ranges = {"diffuse": (0.0, 0.5), "color": (0.0, 0.8), "roughness": (0.1, 0.9), "bend": (0, 0.9)}
    values = {}
    for table in Closures.tables:
        low, high = ranges[table.name.rstrip("0123")]
        level, change = (random.uniform(low, high, (table.rows, n)) for n in (1, table.nodes))
        values[table.name] = 0.7 * level + 0.3 * change
    return Closures(**{"name": f"paint {seed}", **settings}, **values)


KNOWN = {"fit": {"views_psnr": 41.23456, "seed": 0}, "source": {"file": "a.bsdf", "terms": "CC0"}}
FACTS = "Fit views psnr", "41.235", "Source file", "a.bsdf", "Source terms", "CC0"
MATERIALS: list[Brdf] = [mixture(k, metadata=KNOWN) for k in range(9)] + [EXAMPLES["principled"]]


def test_the_addon_needs_nothing_but_blender():
    tree = ast.parse(addon())
    modules = {
        alias.name if isinstance(node, ast.Import) else node.module
        for node in ast.walk(tree)
        if isinstance(node, ast.Import | ast.ImportFrom)
        for alias in node.names
    }
    tops = {module.partition(".")[0] for module in modules}
    assert {"bpy", "json"} <= tops <= {*sys.stdlib_module_names, "bpy", "bpy_extras", "bmesh"}
    # Blender reads this without running the file, up to the first empty line.
    text = addon().decode().partition("\nbl_info = ")[2].partition("\n\n")[0]
    assert ast.literal_eval(text)["blender"] == (4, 2, 0)


def test_the_zip_is_an_extension():
    """Blender's schema 1.0.0, strictly: developer.blender.org/docs/features/extensions/schema."""
    with zipfile.ZipFile(io.BytesIO(extension())) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    assert set(files) == {f"nacre_materials/{n}" for n in ("blender_manifest.toml", "__init__.py")}
    assert files["nacre_materials/__init__.py"] == addon()
    about = tomllib.loads(files["nacre_materials/blender_manifest.toml"].decode())
    needed = {"schema_version", "id", "version", "name", "tagline", "maintainer", "type"}
    needed |= {"blender_version_min", "license"}
    others = {"website", "tags", "blender_version_max", "copyright", "platforms", "wheels"}
    assert needed <= set(about) <= {*needed, *others, "permissions", "build"}
    assert (about["schema_version"], about["type"]) == ("1.0.0", "add-on")
    assert about["id"].isidentifier()
    assert not about["id"].startswith("_")
    for terse in (about["tagline"], *about["permissions"].values()):
        assert len(terse) <= 64
        assert terse[-1].isalnum()  # no punctuation at the end
        assert terse.isprintable()
    assert set(about["permissions"]) <= {"files", "network", "clipboard", "camera", "microphone"}
    assert about["license"] == ["SPDX:MIT"]
    assert all(line.split()[0].isdigit() for line in about["copyright"])
    # What Blender's interface lists as tags of add-ons.
    assert set(about["tags"]) <= {"Import-Export", "Material", "Node", "Render"}
    text = addon().decode().partition("\nbl_info = ")[2].partition("\n\n")[0]
    old = ast.literal_eval(text)
    for new, former in ((about["version"], "version"), (about["blender_version_min"], "blender")):
        assert tuple(map(int, new.split("."))) == old[former]
    assert about["name"] == old["name"]


def test_the_same_addon_is_the_same_file():
    assert extension() == extension()
    with zipfile.ZipFile(io.BytesIO(extension())) as archive:
        assert {member.date_time[0] for member in archive.infolist()} == {1980}


def test_the_addon_knows_the_models():
    assert closures.NODES == reading.FACING
    for name, (tables, _) in reading.MODELS.items():
        known = MODELS[name].numbers()
        assert tables.keys() == {each.name for each in known}
        for each in known:
            height, low, high = tables[each.name]
            assert low <= each.low < each.high <= high
            assert height == (each.rows if MODELS[name].tables else 3 if each.color else 1)


@pytest.mark.parametrize("model", reading.MODELS)
def test_what_nacre_writes_is_read(model: str):
    found = reading.read(encode(EXAMPLES[model]), "a.json")
    assert (found.name, found.model) == (model, model)
    for name, value in EXAMPLES[model].values.items():
        rows = np.reshape(value, np.shape(found.values[name]))
        np.testing.assert_array_equal(rows, found.values[name])


HOSTILE = {
    "empty": b"",
    "text": b"hello",
    "not UTF-8": b"\xff\xfe\x00",
    "deep": b"[" * 100_000,
    "a list": b"[1, 2]",
    "other model": b'{"model": "ggx", "parameters": {}}',
    "no parameters": b'{"model": "closures"}',
    "a model that is no name": b'{"model": ["closures"]}',
    "long": b'{"model": "closures"}' + b" " * (1 << 20),
    "version": b'{"model": "closures", "version": 2, "parameters": {}}',
    "names": b'{"model": "closures", "parameters": {"evil\\n": 1}}',
}


def damaged(random: Random) -> bytes:
    """A file of which one thing is odd, or the end is missing."""
    content = json.loads(encode(EXAMPLES[random.choice(list(reading.MODELS))]))
    values, choice = content["parameters"], random.random()
    if choice < 0.3:
        return json.dumps(content).encode()[: -random.randint(1, 400)]
    name = random.choice(list(values))
    if choice < 0.6:
        values[name] = odd_json(random)
    elif choice < 0.8:
        number = random.choice((float("nan"), -1.0, 1e9, 10**400, True, "1", None, [[[]]], []))
        rows = values[name]
        if isinstance(rows, list) and isinstance(rows[0], list):
            rows[0][0] = number
        else:
            values[name] = number
    else:
        values[random.choice((name, "more"))] = [[0.5] * 8]
    return json.dumps(content).encode()


@contextlib.contextmanager
def collected(messages: list[str]) -> Iterator[None]:
    """Collect what is said of files that are refused."""
    try:
        yield
    except reading.MaterialError as error:
        messages.append(str(error))


def one_line(content: bytes) -> str:
    with pytest.raises(reading.MaterialError) as caught:
        reading.read(content, "x\ny.json")
    return str(caught.value)


@pytest.mark.parametrize("name", HOSTILE)
def test_what_is_no_material_is_refused_in_a_line(name: str):
    message = one_line(HOSTILE[name])
    assert message.startswith("x y.json: ")
    assert message.isprintable()
    assert len(message) < 300


def test_damaged_files_are_refused_in_a_line():
    random, messages = Random(0), []
    for _ in range(500):
        with collected(messages):
            reading.read(damaged(random), "x")
    assert len(messages) > 450  # an odd value may be a number
    assert all(message.isprintable() for message in messages)


def test_facts_are_bounded_lines():
    metadata = {"fit": {"loss": 0.125, "a\nb": "x" * 1000, "c": [1]}, "source": {"terms": TERMS}}
    facts = reading.read(encode(mixture(0, metadata=metadata)), "x").facts
    assert facts["Model"] == "closures"
    assert facts["Fit loss"] == "0.125"
    assert facts["Source terms"].startswith("CC0")
    assert all(key.isprintable() and text.isprintable() for key, text in facts.items())
    assert max(map(len, facts.values())) <= 200


def test_a_name_is_data_of_the_script():
    """But for it and comments, the script is that of a harmless material."""

    def code(text: str) -> tuple[str, str]:
        brdf = mixture(0, name=text, source={"terms": text})
        (content,) = TARGETS["blender-closures"]().files(brdf, "same").values()
        _, *statements = ast.parse(content).body
        (data,) = (each for each in statements if ast.unparse(each).startswith("MATERIAL ="))
        statements.remove(data)
        return ast.unparse(statements), ast.literal_eval(data.value)

    (evil, given), (harmless, _) = code(TERMS), code("harmless")
    assert evil == harmless
    assert json.loads(given)["metadata"]["source"]["terms"] == TERMS


def test_a_file_lies_beside_the_addon():
    written = TARGETS["blender-addon"]().files(mixture(3), "paint")
    assert written[ADDON] == extension()
    assert reading.read(written["paint.json"], "paint.json").name == "paint 3"


@pytest.fixture(scope="module")
def session(tmp_path_factory) -> tuple[Path, dict[str, Any], np.ndarray]:
    """The folder of ten materials, what a session with the add-on finds, and its pictures."""
    needs(blender.missing())
    folder = tmp_path_factory.mktemp("session")
    files = folder / "files"
    files.mkdir()
    for k, brdf in enumerate(MATERIALS):
        (files / f"{k}.json").write_bytes(encode(brdf))
    (files / "other.json").write_text("{}")
    (folder / MODULE).write_bytes(addon())
    found, pictures = blender_addon.run("addon", folder / MODULE, files, SIZE)
    return files, found, pictures


def error(picture: np.ndarray, brdf: Brdf) -> np.ndarray:
    expected, _ = render_sphere(brdf, DirectionalLight(), SIZE)
    return np.abs(tone_map(picture) - tone_map(expected))


def test_cycles_renders_what_we_do(session):
    _, found, pictures = session
    assert [found[brdf.name]["facts"]["Name"] for brdf in MATERIALS] == [b.name for b in MATERIALS]
    assert len(pictures) == len(MATERIALS)
    for name, picture in zip(sorted(b.name for b in MATERIALS), pictures, strict=True):
        (brdf,) = (each for each in MATERIALS if each.name == name)
        assert tone_map(picture).mean() > 0.1
        # Of Principled, renderers have tables that are not the same.
        assert error(picture, brdf).max() < (0.01 if isinstance(brdf, Closures) else 0.05)


def test_the_panel_shows_what_is_known(session):
    assert session[1]["panel"] == ["Name", "paint 0", "Model", "closures", *FACTS]


def test_ramps_and_curves_have_the_numbers(session):
    nodes, values = session[1]["paint 2"], MATERIALS[2].values
    for name in ("diffuse", "color1", "color2", "color3"):
        expected = np.vstack([closures.NODES, values[name]]).T
        np.testing.assert_allclose(nodes["ramps"][name], expected, atol=1e-6)
    rows = {f"bend{k}": values[f"bend{k}"][0] for k in range(4)}
    for k in range(1, 4):
        along, across = values[f"roughness{k}"]
        rows |= {f"roughness{k} along": along, f"roughness{k} across": across}
    assert nodes["curves"].keys() == rows.keys()
    for name, row in rows.items():
        expected = np.stack([closures.NODES, row]).T
        np.testing.assert_allclose(nodes["curves"][name], expected, atol=1e-6)


def test_nothing_is_replaced_unasked(session):
    files, found, _ = session
    assert "nacre_materials.blend" in found["again"]
    assert found["again"].count("\n") == 0
    assert [Path(path) for path in found["libraries"]] == [files]
    assert found["materials after"] == len(MATERIALS)
    assert "choose" in found["nothing"]
    assert found["empty"] == "Error: nacre: empty: no file here is a nacre material"


def test_a_folder_is_a_library_of_assets_with_thumbnails(session):
    files, _, _ = session
    found, thumbnails = blender_addon.run("library", files / "nacre_materials.blend")
    assert set(found) == {brdf.name for brdf in MATERIALS}
    catalogs = (files / "blender_assets.cats.txt").read_text()
    for asset in found.values():
        assert f"\n{asset['catalog']}:nacre/" in catalogs
        assert asset["tags"][0] == "nacre"
    assert thumbnails.shape == (len(MATERIALS), 128, 128, 4)
    assert thumbnails[:, 64, 64, 3].min() > 0.99
    assert thumbnails[:, 0, 0, 3].max() == 0.0
    inside = thumbnails[:, 32:96, 32:96, :3].reshape(len(MATERIALS), -1)
    assert inside.std(axis=1).min() > 0.02  # shaded
    assert len(np.unique(inside.mean(axis=1))) == len(MATERIALS)


def test_a_script_adds_its_material(tmp_path: Path):
    needs(blender.missing())
    brdf = mixture(5, source={"terms": TERMS})
    for name, content in TARGETS["blender-closures"]().files(brdf, "five").items():
        (tmp_path / name).write_bytes(content)
    found, pictures = blender_addon.run("script", tmp_path / "five.py", SIZE)
    assert found["paint 5"]["facts"]["Source terms"].startswith("CC0")
    assert error(pictures[0], brdf).max() < 0.01


def test_blender_says_in_a_line_what_is_wrong(tmp_path: Path):
    needs(blender.missing())
    (tmp_path / MODULE).write_bytes(addon())
    files = tmp_path / "files"
    files.mkdir()
    cases = {**HOSTILE, "truncated": encode(mixture(0))[:-300]}
    for name, content in cases.items():
        (files / f"{name}.json").write_bytes(content)
    found, _ = blender_addon.run("hostile", tmp_path / MODULE, files)
    assert found.pop("materials after") == 0
    assert set(found) == {f"{name}.json" for name in cases}
    for name, message in found.items():
        assert message.startswith(f"Error: {name}: ")
        assert message.count("\n") == 0
