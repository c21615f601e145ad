"""`nacre measure bsdf`: Mitsuba's materials as files, and what it says of those it cannot take."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from click.testing import CliRunner

import nacre
from tests.variants import require_mitsuba

GREY = '{"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.5, 0.25, 0.1]}}'
SCENE = """<scene version="3.0.0">
  <shape type="sphere"><bsdf type="diffuse" id="matte">
    <rgb name="reflectance" value="0.5, 0.25, 0.1"/></bsdf></shape>
  <shape type="sphere"><bsdf type="roughconductor" id="metal"/></shape>
  <shape type="sphere"/>
  <shape type="sphere"><bsdf type="diffuse"/></shape>
</scene>"""


def run(*arguments: object) -> tuple[int, str]:
    """Exit code and all output of the command, in this process."""
    from nacre.cli import main

    code = 0
    with CliRunner().isolation() as streams:
        try:
            main([str(a) for a in arguments])
        except SystemExit as stop:
            code = int(stop.code or 0)
        return code, "".join(stream.getvalue().decode() for stream in streams[:2])


@pytest.fixture(autouse=True)
def variant():
    require_mitsuba()


def assert_diffuse(path, tolerance):
    wi = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]])
    f_r = nacre.load(path).eval(wi, wi[::-1])
    np.testing.assert_allclose(f_r * math.pi, [[0.5, 0.25, 0.1]] * 2, rtol=tolerance)


@pytest.mark.parametrize("ending", [".bsdf", ".binary"])
def test_a_description_becomes_a_table(tmp_path, ending):
    path = tmp_path / f"grey{ending}"
    code, text = run("measure", "bsdf", GREY, "-o", path)
    assert code == 0, text
    assert f"{path.stat().st_size:,} bytes" in text
    assert_diffuse(path, 1e-3)
    assert nacre.load(path).name == "grey"


def test_a_description_becomes_a_neural_material(tmp_path):
    path = tmp_path / "grey.safetensors"
    code, text = run("measure", "bsdf", GREY, "-o", path, "--preset", "draft")
    assert code == 0, text
    assert_diffuse(path, 0.05)
    assert nacre.load(path).inputs == "enhanced"
    code, text = run("measure", "bsdf", GREY, "-o", tmp_path / "grey.h5", "--preset", "draft")
    assert code == 0, text
    assert "grey.h5: fitted with the paper's inputs, which .h5 files need" in text
    assert_diffuse(tmp_path / "grey.h5", 0.05)


def test_a_material_of_a_scene_is_measured(tmp_path):
    (tmp_path / "scene.xml").write_text(SCENE)
    scene = [tmp_path / "scene.xml"]
    code, text = run("measure", "bsdf", *scene, "--bsdf", "matte", "-o", tmp_path / "x.binary")
    assert code == 0, text
    assert_diffuse(tmp_path / "x.binary", 1e-3)
    for extra, words in (
        ([], "use --bsdf (found: matte, metal, 2 without an id)"),
        (["--bsdf", "x"], "no BSDF 'x' (found: matte, metal, 2 without an id)"),
    ):
        code, text = run("measure", "bsdf", *scene, *extra, "-o", tmp_path / "y.binary")
        assert code == 2
        assert words in text


@pytest.mark.parametrize(
    ("description", "words"),
    [
        ("{", "is no JSON"),
        ("[1]", "expected an object with a type"),
        ('{"type": "nonsense"}', "nonsense"),
        ('{"type": "diffuse", "wrong": 1}', "wrong"),
        ('{"type": "sphere"}', "is not a BSDF"),
        ('{"type": "conductor"}', "only in single directions"),
        ('{"type": 3}', "expected an object with a type"),
        ('{"type": "diffuse", "reflectance": NaN}', "NaN is not a number"),
        ("[" * 100_000, "nested too deeply"),
        ('{"type": ' * 900 + "1" + "}" * 900, "nested too deeply"),
        ('{"type": "twosided", "a": {"type": "diffuse", "reflectance": null}}', "a.reflectance is"),
        ('{"type": "twosided", "a": {"type": "blendbsdf"}}', "a has no weight"),
        ('{"type": "principled", "anisotropic": 255}', "values that are not finite"),
        (
            '{"type": "bumpmap", "map": {"type": "checkerboard"}, "b": {"type": "diffuse"}}',
            "try a bitmap",
        ),
    ],
)
def test_what_cannot_be_measured_is_refused_in_one_line(tmp_path, description, words):
    code, text = run("measure", "bsdf", description, "-o", tmp_path / "x.bsdf")
    assert code == 2
    lines = [line for line in text.splitlines() if line.startswith("nacre: ")]
    assert len(lines) == 1, text
    assert words in lines[0]
    assert not list(tmp_path.iterdir())


def test_targets_that_cannot_hold_it_are_refused_before_the_work(tmp_path, monkeypatch):
    brushed = '{"type": "roughconductor", "alpha_u": 0.1, "alpha_v": 0.4}'
    monkeypatch.setattr("nacre.neural.fit", None)
    monkeypatch.setattr("nacre.measured.rgl.tabulate_tables", None)
    for description, target, words in (
        (brushed, "x.h5", "hold isotropic reflectance only; x is anisotropic"),
        (brushed, "x.binary", "hold isotropic reflectance only"),
        (GREY, "absent/x.bsdf", "does not exist; create it first"),
    ):
        code, text = run("measure", "bsdf", description, "-o", tmp_path / target)
        assert code == 2
        assert words in text
    code, text = run("measure", "bsdf", GREY, "-o", tmp_path / "x.bsdf", "--resolution", "1,2")
    assert code == 2
    assert "expected phi_i,theta_i,square,azimuths,polars" in text
    assert not list(tmp_path.iterdir())


def test_a_table_has_the_resolution_that_is_asked_for(tmp_path):
    path = tmp_path / "grey.binary"
    code, text = run("measure", "bsdf", GREY, "-o", path, "--resolution", "12,10,8")
    assert code == 0, text
    assert nacre.load(path).dimensions == (12, 10, 8)
    assert_diffuse(path, 1e-3)


def test_textures_are_read_in_their_middle(tmp_path):
    import mitsuba as mi

    pixels = np.full((4, 4, 3), [0.5, 0.25, 0.1], np.float32)
    mi.Bitmap(pixels).write(str(tmp_path / "flat.exr"))
    texture = {"type": "bitmap", "filename": str(tmp_path / "flat.exr"), "raw": True}
    description = json.dumps({"type": "diffuse", "reflectance": texture})
    code, text = run("measure", "bsdf", description, "-o", tmp_path / "x.binary")
    assert code == 0, text
    assert_diffuse(tmp_path / "x.binary", 1e-3)


def test_a_bump_makes_a_material_anisotropic(tmp_path):
    import mitsuba as mi

    ramp = np.repeat(np.tile(np.linspace(0, 1, 16, dtype=np.float32), (16, 1))[..., None], 3, 2)
    mi.Bitmap(ramp).write(str(tmp_path / "ramp.exr"))
    texture = {"type": "bitmap", "filename": str(tmp_path / "ramp.exr"), "raw": True}
    description = json.dumps({"type": "bumpmap", "map": texture, "nested": {"type": "diffuse"}})
    code, text = run("measure", "bsdf", description, "-o", tmp_path / "x.binary")
    assert code == 2
    assert "hold isotropic reflectance only; x is anisotropic" in text


@pytest.mark.parametrize(
    ("description", "words"),
    [
        ('{"type": "plastic"}', "without mirror reflection\n"),
        ('{"type": "mask", "opacity": 0.5, "b": {"type": "diffuse"}}', "without transmission\n"),
        (GREY, ""),
    ],
)
def test_what_no_table_holds_is_said(tmp_path, description, words):
    code, text = run("measure", "bsdf", description, "-o", tmp_path / "x.bin")
    assert code == 0, text
    assert words in text
    assert ("note" in text) == bool(words)


def test_one_source_is_wanted(tmp_path):
    code, text = run("measure", "bsdf", GREY, "--bsdf", "x", "-o", tmp_path / "x.bsdf")
    assert code == 2
    assert "--bsdf is for a scene (.xml)" in text
    code, text = run("measure", "bsdf", "-o", tmp_path / "x.bsdf")
    assert code == 2
    assert "type: nacre measure bsdf INPUT" in text
    code, text = run("measure", "bsdf", tmp_path / "absent.json", "-o", tmp_path / "x.bsdf")
    assert code == 2
    assert "absent.json: no such file" in text


def test_a_description_is_read_from_a_file_or_standard_input(tmp_path, monkeypatch):
    (tmp_path / "grey.json").write_text(GREY)
    code, text = run("measure", "bsdf", tmp_path / "grey.json", "-o", tmp_path / "x.binary")
    assert code == 0, text
    assert_diffuse(tmp_path / "x.binary", 1e-3)
    with CliRunner().isolation(GREY):
        from nacre.cli import main

        main(["-q", "measure", "bsdf", "-", "-o", str(tmp_path / "y.binary")])
    assert (tmp_path / "y.binary").read_bytes() == (tmp_path / "x.binary").read_bytes()
