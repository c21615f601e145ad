"""The whole data set: resumed, with its settings kept, and the command."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from nacre.cli.btf.capture import command
from nacre.errors import FormatError
from nacre.runtime.lock import exclusive
from nacre.textures.capture import built_in, capture, dataset, find
from nacre.textures.capture.dataset import MANIFEST, Settings, capture_all
from tests.textures.capture.surfaces import directions

SETTINGS = Settings(directions((30.0, 0.0)), directions((0.0, 0.0)), 3, 2)
NAMES = ("wood11", "wood12", "stone12")


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three recipes on coarse grids."""
    recipes = tuple(r for r in built_in() if r.name in NAMES)
    monkeypatch.setattr(dataset, "built_in", lambda: recipes)
    monkeypatch.setattr(Settings, "cells", 32)


def contents(folder: Path) -> dict[str, np.ndarray]:
    return {
        path.relative_to(folder).as_posix(): read(path)["values"]
        for path in sorted(folder.rglob("*.npz"))
    }


def read(path: Path) -> dict[str, np.ndarray]:
    with np.load(path) as archive:
        return dict(archive)


def test_a_run_that_was_stopped_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    whole, folder = tmp_path / "whole", tmp_path / "stopped"
    capture_all(whole, SETTINGS)
    expected = contents(whole)
    assert list(expected) == ["train/wood11.npz", "unseen/stone12.npz", "unseen/wood12.npz"]

    class Stop(BaseException):
        pass

    def stop(recipe, done, total):
        if done == 1:
            raise Stop
        return lambda *state: None

    with pytest.raises(Stop):
        capture_all(folder, SETTINGS, stop)
    assert list(contents(folder)) == ["train/wood11.npz"]
    (folder / "train" / ".0123456789abcdef.npz").touch()  # as a killed process leaves
    kept = (folder / "train" / "wood11.npz").stat()
    seen = []
    capture_all(folder, SETTINGS, lambda r, done, total: seen.append((r.name, done, total)))
    assert seen == [("wood12", 1, 3), ("stone12", 2, 3)]
    assert (folder / "train" / "wood11.npz").stat() == kept
    assert not list(folder.rglob(".*"))
    for name, values in contents(folder).items():
        assert np.array_equal(values, expected[name])


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"texels": 4}, "texels"),
        ({"samples": 3}, "samples"),
        ({"seed": 1}, "seed"),
        ({"wi": directions((31.0, 0.0))}, "directions"),
    ],
)
def test_other_settings_need_another_folder(tmp_path: Path, change: dict, field: str) -> None:
    capture_all(tmp_path, SETTINGS)
    before = contents(tmp_path)
    settings = Settings(**{**vars(SETTINGS), **change})
    with pytest.raises(FormatError, match=rf"{MANIFEST}: {field}: .*another folder"):
        capture_all(tmp_path, settings)
    assert list(contents(tmp_path)) == list(before)


def test_a_folder_goes_on_that_has_an_earlier_name_of_a_parameter(tmp_path: Path) -> None:
    capture_all(tmp_path, SETTINGS)
    manifest = tmp_path / MANIFEST
    manifest.write_text(manifest.read_text().replace("vein_color", "vein_colour"))
    assert "vein_colour" in manifest.read_text()
    capture_all(tmp_path, SETTINGS)


def test_a_folder_goes_on_that_was_begun_with_fewer_parameters(tmp_path: Path) -> None:
    capture_all(tmp_path, SETTINGS)
    path = tmp_path / MANIFEST
    manifest = json.loads(path.read_text())
    wood = manifest["textures"]["train/wood11.npz"]["parameters"]
    del wood["rays"]
    path.write_text(json.dumps(manifest))
    capture_all(tmp_path, SETTINGS)
    wood["rings"] = 9
    path.write_text(json.dumps(manifest))
    with pytest.raises(FormatError, match="textures: the folder was started with others"):
        capture_all(tmp_path, SETTINGS)


@pytest.mark.parametrize(
    "content", ["", "{", "[]", "{}", '{"textures": {"x": []}}', '{"texels": NaN}', "[" * 5000]
)
def test_a_damaged_manifest_is_named(tmp_path: Path, content: str) -> None:
    (tmp_path / MANIFEST).write_text(content)
    with pytest.raises(FormatError, match=MANIFEST):
        capture_all(tmp_path, SETTINGS)


def test_one_process_at_a_time(tmp_path: Path) -> None:
    with exclusive(tmp_path / ".lock"), pytest.raises(FormatError, match="another process"):
        capture_all(tmp_path, SETTINGS)


def test_the_manifest_tells_what_each_texture_is(tmp_path: Path) -> None:
    capture_all(tmp_path, SETTINGS)
    manifest = json.loads((tmp_path / MANIFEST).read_text())
    assert manifest["texels"] == 3
    assert manifest["textures"]["unseen/wood12.npz"]["family"] == "wood"
    assert manifest["textures"]["unseen/wood12.npz"]["parameters"]["rings"] == 9


def run(*arguments: object) -> str:
    result = CliRunner().invoke(command, [str(a) for a in arguments], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def test_the_command_writes_a_texture_and_a_picture(tmp_path: Path) -> None:
    pillow = pytest.importorskip("PIL.Image", reason="needs the extra 'render'")
    lists = tmp_path / "list.csv"
    lists.write_text("theta,phi\n0,0\n45,180\n70,90\n")
    output, picture = tmp_path / "x.npz", tmp_path / "x.png"
    text = run("fabric12", "-o", output, "--directions", lists, "--texels", 6, "--paths", 2,
               "--seed", 3, "--picture", picture)  # fmt: skip
    assert "6 x 6 texels, 9 pairs" in text
    data = read(output)
    expected = capture(find("fabric12").build(32), data["wi"], data["wo"], 6, samples=2, seed=3)
    assert np.array_equal(data["values"], expected.values)
    assert data["name"] == "fabric12"
    pixels = np.asarray(pillow.open(picture))
    assert pixels.shape[:2] == (3 * (160 // 12 * 12 + 2), 4 * (160 // 12 * 12 + 2))
    assert pixels.std() > 20


def test_the_command_writes_the_heights_that_texels_lie_on(tmp_path: Path) -> None:
    pytest.importorskip("mitsuba", reason="needs the extra 'render'")
    from nacre.textures.height_file import read_heights

    lists = tmp_path / "list.csv"
    lists.write_text("theta,phi\n0,0\n70,90\n")
    output, heights = tmp_path / "x.npz", tmp_path / "x.exr"
    run("carpet12", "-o", output, "--directions", lists, "--texels", 6, "--paths", 2,
        "--height-map", heights)  # fmt: skip
    surface, data = find("carpet12").build(32), read(output)
    np.testing.assert_array_equal(read_heights(heights), surface.height_map())
    plain, expected = (
        capture(surface, data["wi"], data["wo"], 6, samples=2, on_surface=on_surface).values
        for on_surface in (False, True)
    )
    assert np.array_equal(data["values"], expected)
    assert not np.array_equal(expected, plain)


def test_the_command_captures_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    monkeypatch.setattr("nacre.cli.btf.capture.aside", said.append)
    lists = tmp_path / "list.csv"
    lists.write_text("theta,phi\n0,0\n")
    arguments = (
        "--all",
        "-o",
        tmp_path / "set",
        "--directions",
        lists,
        "--texels",
        2,
        "--paths",
        1,
    )
    run(*arguments)
    assert said[-1] == "3 of 3: stone12"
    assert len(contents(tmp_path / "set")) == 3
    run(*arguments)
    assert len(said) == 3


@pytest.mark.parametrize(
    "arguments",
    [
        (),
        ("fabric01", "--all"),
        ("--all", "--picture", "x.png"),
        ("--all", "--height-map", "x.exr"),
    ],
)
def test_the_command_takes_one_or_all(tmp_path: Path, arguments: tuple[str, ...]) -> None:
    result = CliRunner().invoke(command, [*arguments, "-o", str(tmp_path / "x.npz")])
    assert result.exit_code == 2
