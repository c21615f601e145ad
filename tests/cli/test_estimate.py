"""`nacre estimate` of photographs of a sphere, rendered with no part of what reads them."""

from __future__ import annotations

import gc
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.analytic import Ggx
from nacre.latent.estimates import COUNT, plausible
from nacre.metrics import albedo
from nacre.mitsuba.environment import Environment
from nacre.mitsuba.lights import EnvironmentLight
from nacre.mitsuba.preview import write_image
from nacre.mitsuba.sphere import render_sphere
from nacre.neural import Recipe, fit
from tests.cli.support import assert_refused, run, run_json
from tests.variants import require_mitsuba

TRUTH = Ggx(name="paint", diffuse=(0.3, 0.1, 0.05), specular=(0.05, 0.05, 0.05), roughness=0.2)
SPHERE = "--geometry", "sphere", "--environment", "sky.exr"


@pytest.fixture(autouse=True)
def _nothing_left() -> Iterator[None]:
    """No materials of other scenes, which Dr.Jit would compile into each kernel."""
    gc.collect()
    yield
    gc.collect()


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a map and a picture of a sphere under it."""
    require_mitsuba()
    monkeypatch.chdir(tmp_path)
    pixels = np.full((16, 32, 3), 0.3, np.float32)
    pixels[3:6, 18:21] = 8.0
    sky = Environment(pixels)
    picture, _ = render_sphere(TRUTH, EnvironmentLight(sky), 20)
    write_image(sky.pixels, "sky.exr")
    write_image(picture, "photo.exr")
    return tmp_path


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two rounds, and a draft of a network."""
    monkeypatch.setattr("nacre.photographs.estimate.ROUNDS", 2)
    draft = lambda *a, **settings: fit(*a, Recipe.preset("draft"), **settings)  # noqa: E731
    monkeypatch.setattr("nacre.photographs.estimate.fit", draft)


@pytest.mark.slow
@pytest.mark.usefixtures("quick")
def test_a_network_of_a_sphere(capsys, here):
    found = run_json(capsys, "estimate", "photo.exr", *SPHERE, "-o", "paint.safetensors")
    assert found["output"] == "paint.safetensors"
    assert found["unexplained"] < 0.1
    assert found["camera_factors"] is None
    (facts,) = run_json(capsys, "info", "paint.safetensors")
    assert facts["known_from_pixels"] == found["known_from_pixels"] > 200
    material = nacre.load("paint.safetensors")
    assert len(plausible(material)) == COUNT
    true, seen = (np.asarray(albedo(m, [0.5]).value) for m in (TRUTH, material))
    np.testing.assert_allclose(seen, true, rtol=0.08)


@pytest.mark.slow
@pytest.mark.usefixtures("quick")
def test_python_estimates_what_the_command_does(capsys, here):
    run_json(capsys, "estimate", "photo.exr", *SPHERE, "-o", "paint.safetensors")
    light, photo = "sky.exr", _read("photo.exr")
    for pictures in ("photo.exr", [photo]):
        found = nacre.estimate(pictures, geometry="sphere", environment=light)
        written = nacre.load("paint.safetensors")
        assert all(
            np.array_equal(a, b)
            for mine, other in zip(found.layers, written.layers, strict=True)
            for a, b in zip(mine, other, strict=True)
        )
        assert len(plausible(found)) == COUNT


@pytest.mark.slow
@pytest.mark.usefixtures("quick")
def test_a_code_of_two_pictures_of_a_sphere(capsys, here):
    write_image(1.3 * _read("photo.exr"), "bright.exr")
    extra = "--camera", "exposure", "-o", "paint.json"
    assert run("estimate", "photo.exr", "bright.exr", *SPHERE, *extra, quiet=False) == 0
    printed = capsys.readouterr()
    assert " pixels: albedo" in printed.out
    factors = [float(line.split()[-1]) for line in printed.err.splitlines() if "factor" in line]
    assert factors[1] / factors[0] == pytest.approx(1.3, rel=0.03)
    assert len(json.loads(Path("paint.json").read_text())["values"]) == 32
    assert nacre.latent.load_code("paint.json", nacre.latent.pretrained_basis()).name == "paint"


def _read(name: str) -> Any:
    import mitsuba as mi

    return np.array(mi.Bitmap(name))


def test_what_is_refused(capsys, here):
    def refused(words: str, *arguments: object) -> None:
        assert_refused(capsys, words, "estimate", *arguments)

    output = "-o", "x.safetensors"
    refused("is a .safetensors or a .json file", "photo.exr", *SPHERE, "-o", "x.bsdf")
    refused("say what was photographed", "photo.exr", *output)
    refused("--geometry needs --environment", "photo.exr", "--geometry", "sphere", *output)
    Path("s.xml").touch()
    refused("--scene needs --bsdf", "photo.exr", "--scene", "s.xml", *output)
    refused("scene.xml: no such file", "photo.exr", "--scene", "scene.xml", "--bsdf", "a", *output)
    refused("none.exr: ", "none.exr", *SPHERE, *output)
    refused("expected 1 to 8 photographs, not 9", *["photo.exr"] * 9, *SPHERE, *output)
    refused("none.safetensors", "photo.exr", *SPHERE, "--basis", "none.safetensors", *output)
    Path("cut.exr").write_bytes(Path("photo.exr").read_bytes()[:-99])
    refused("cut.exr: cannot be decoded", "photo.exr", "cut.exr", *SPHERE, *output)
    write_image(_read("photo.exr")[:10], "half.exr")
    refused("half.exr: has 20 x 10 pixels; its sensor in", "half.exr", *SPHERE, *output)
    Path("mine.json").write_text('{"mine": 1}')
    refused("mine.json", "photo.exr", *SPHERE, "-o", "mine.json")
    assert Path("mine.json").read_text() == '{"mine": 1}'
    Path("sky.json").write_bytes(Path("sky.exr").read_bytes())
    refused("sky.json: is the input as well", "sky.json", *SPHERE, "-o", "sky.json", "--force")
