"""Options of readers on every command that takes materials."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import nacre
from nacre.cli.reading import _OPTIONS
from tests.cli.support import run, run_json

COMMANDS = ("info", "fit", "render", "compare", "plot", "view", "convert", "export")


def gltf(path: Path, names: tuple[str, ...] = ("", "")) -> None:
    materials = [
        {
            **({"name": name} if name else {}),
            "pbrMetallicRoughness": {"roughnessFactor": 0.3 + 0.2 * k},
        }
        for k, name in enumerate(names)
    ]
    path.write_text(json.dumps({"asset": {"version": "2.0"}, "materials": materials}))


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    gltf(tmp_path / "two.gltf")
    gltf(tmp_path / "named.gltf", ("gold", "red paint", "gold"))
    rows = [f"{i},{o},180,{0.1 + 0.01 * o},{0.3}" for i in (10, 30) for o in range(0, 70, 5)]
    (tmp_path / "scan.csv").write_text("\n".join(["inc,view,phi,905 nm,1550 nm", *rows]))
    return tmp_path


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_every_option(capsys, command):
    assert run("help", command) == 0
    printed = capsys.readouterr().out
    assert all(flag in printed for flag, _, _ in _OPTIONS)


def test_info_lists_the_materials_of_a_file(capsys, here):
    assert run("info", "two.gltf", "named.gltf") == 0
    printed = capsys.readouterr().out
    assert "A file of 2 materials" in printed
    assert printed.count("(no name)") == 2
    assert "2  red paint" in printed
    (found,) = run_json(capsys, "info", "named.gltf")
    assert found["materials"] == ["gold", "red paint", "gold"]


def test_one_of_several_by_number_and_by_name(capsys, here):
    (found,) = run_json(capsys, "info", "two.gltf", "--material", "2", "--no-physics")
    assert "roughnessFactor 0.5" in found["summary"][1]
    assert run("convert", "named.gltf", "--material", "red paint", "-o", "red.glb") == 0
    assert nacre.load("red.glb").name == "red paint"
    assert run("info", "two.gltf", "--material", "3") == 2
    assert "has no material '3' among its 2" in capsys.readouterr().err
    assert run("info", "named.gltf", "--material", "gold") == 2
    assert "2 materials are named 'gold'" in capsys.readouterr().err
    assert run("render", "two.gltf") == 2
    assert "give a name or a number from 1 to 2 as --material" in capsys.readouterr().err


def test_a_fit_is_named_by_its_material(capsys, here):
    options = ("--model", "lambert", "--samples", 1000)
    assert run("fit", "named.gltf", "--material", "red paint", *options, quiet=False) == 0
    printed = capsys.readouterr().out
    assert (here / "named_red_paint.json").exists()
    assert "nacre compare named.gltf named_red_paint.json --material 'red paint'" in printed


def test_files_that_hold_several_take_theirs_in_order(capsys, here):
    options = ("--size", 16, "-o", "a.png")
    both = ("--material", "1", "--material", "1")
    assert run("compare", "two.gltf", "two.gltf", "--material", "2", *options) == 0
    capsys.readouterr()
    assert run("compare", "two.gltf", "named.gltf", *both, *options[:2], "-o", "b.png") == 0
    assert "The pictures are equal" in capsys.readouterr().out
    assert run("info", "two.gltf", *both) == 2
    assert "--material is given 2 times, for 1 files" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("info", "scan.csv", "--as-stored"), "--as-stored is not for scan.csv"),
        (("info", "scan.csv", "--material", "1"), "--material is for files that hold several"),
        (("info", "two.gltf", "--columns", "f=1"), "--columns is not for two.gltf"),
        (("info", "scan.csv", "--columns", "f"), "expected NAME=COLUMN"),
        (("info", "scan.csv", "--quantity", "lumen"), "not one of"),
        (("info", "scan.csv", "--quantity", "brdf", "--bands", "color"), "make no color"),
        (("info", "scan.csv", "--quantity", "brdf", "--bands", "700"), "no band is near 700 nm"),
        (("fit", ".", "-o", "fits/", "--quantity", "brdf"), "--quantity is not for folders"),
    ],
)  # fmt: skip
def test_options_that_fit_nothing_are_refused(capsys, here, arguments, words):
    assert run(*arguments) == 2
    assert words in capsys.readouterr().err


def test_bands_stay_bands(capsys, here):
    options = ("--quantity", "brdf")
    assert run("fit", "scan.csv", *options, "--epochs", 2, "-o", "a.safetensors") == 0
    network = nacre.load("a.safetensors")
    assert network.channels == ("1550 nm", "905 nm", "905 nm")
    assert any("Columns are read as theta_i=inc" in note for note in network.notes)
    (found,) = run_json(capsys, "info", "a.safetensors", "--no-physics")
    assert "with the bands 1550 nm and 905 nm in place of colors" in found["summary"][0]
    assert run("export", "a.safetensors", "--to", "glsl", "-o", "a.glsl") == 0
    assert "in place of red, green and blue: 1550 nm, 905 nm" in Path("a.glsl").read_text()
    chosen = ("--bands", "905", "--epochs", 2, "-o", "b.safetensors")
    assert run("fit", "scan.csv", *options, *chosen) == 0
    assert nacre.load("b.safetensors").channels == ("905 nm",) * 3
