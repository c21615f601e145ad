"""Scenes and photographs that do not go together; materials within scenes."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nacre.errors import FormatError, NacreError
from nacre.latent import pretrained_basis, save_basis
from nacre.latent.estimates import COUNT, Estimate, plausible
from nacre.mitsuba.preview import write_image
from nacre.neural import Layer, NeuralBrdf
from nacre.photographs import estimate as work
from nacre.photographs.recording import Recording
from tests.latent.made import basis as pca_basis
from tests.latent.made import random_basis
from tests.variants import require_mitsuba

CODE = pretrained_basis().examples[40].astype(float)
GRAY = np.full((12, 16, 3), 0.2, np.float32)

SENSOR = """<sensor type="perspective">
  <transform name="to_world"><lookat origin="0,0,5" target="0,0,0" up="0,1,0"/></transform>
  <film type="hdrfilm">
    <integer name="width" value="16"/><integer name="height" value="12"/>
    <rfilter type="box"/>
  </film>
</sensor>"""
BALL = '<shape type="sphere"><ref id="paint"/></shape>'
FLOOR = """<shape type="rectangle">
  <transform name="to_world">
    <scale value="3"/><rotate x="1" angle="-60"/><translate y="-0.7"/>
  </transform>
  <ref id="paint"/>
</shape>"""
PAINT = '<bsdf type="diffuse" id="paint"/>'
LIGHT = '<emitter type="envmap"><string name="filename" value="sky.exr"/></emitter>'


@pytest.fixture(autouse=True)
def _nothing_left() -> Iterator[None]:
    """No materials of other scenes, which Dr.Jit would compile into each kernel."""
    gc.collect()
    yield
    gc.collect()


@pytest.fixture
def mi() -> Any:
    return require_mitsuba()


def scene(folder: Path, *parts: str) -> Path:
    """A scene file with the map that it names beside it."""
    folder.mkdir(exist_ok=True)
    rows = np.linspace(2.0, 0.1, 8, dtype=np.float32)[:, None, None]
    write_image(np.broadcast_to(rows, (8, 16, 3)), folder / "sky.exr")
    path = folder / "scene.xml"
    path.write_text(f'<scene version="3.0.0">{"".join(parts)}</scene>')
    return path


def refused(path: Path, words: str, *pictures: Any, bsdf: str = "paint", **settings: Any) -> None:
    """An estimate ends with one line that has these words."""
    with pytest.raises(NacreError) as found:
        work.estimate_from_photographs(
            pictures or [GRAY], work.scene_setting(path, bsdf), **settings
        )
    assert words in str(found.value)
    assert "\n" not in str(found.value)


def test_a_code_that_is_put_into_a_scene_is_what_all_its_things_reflect(mi, tmp_path):
    path = scene(tmp_path / "room", SENSOR, PAINT, BALL, FLOOR, LIGHT)
    setting = work.scene_setting(path, "paint")
    made = setting.load({"code": "0 " * len(CODE), "basis": "neural"})
    rays = mi.Ray3f(mi.Point3f([0.0, 2.0], [0.0, 0.0], 5.0), mi.Vector3f(0.0, 0.0, -1.0))
    hit = made.ray_intersect(rays)
    light = np.array([[0.3, -0.2, 0.93], [0.1, 0.4, 0.91]])
    view = np.array(hit.wi).T
    assert 0.2 < view[1, 2] < 0.9 < view[0, 2]  # of the floor and the ball

    def seen() -> Any:
        toward = mi.Vector3f(*light.T.astype(np.float32))
        return np.array(hit.bsdf().eval(mi.BSDFContext(), hit, toward)).T

    before = seen()
    lobes = work._put(work._bsdf(made, setting), CODE)
    known = pretrained_basis().decode(CODE)
    expected = known.eval(light / np.linalg.norm(light, axis=1, keepdims=True), view) * light[:, 2:]
    np.testing.assert_allclose(seen(), expected, rtol=2e-2)
    assert np.abs(np.log(before / expected)).min() > 0.05
    assert type(lobes) is type(known.sampler)


def test_scenes_that_cannot_be_are_refused(mi, tmp_path):
    refused(tmp_path / "none.xml", "none.xml: no such file")
    path = scene(tmp_path, SENSOR, PAINT, BALL, LIGHT)
    refused(path, "has no BSDF 'gold' (found: paint)", bsdf="gold")
    refused(path, "expected 1 to 8 photographs, not 9", *[GRAY] * 9)
    refused(path, "photograph 1: has 12 x 12 pixels; its sensor in", GRAY[:, :12])
    save_basis(pca_basis(), tmp_path / "pca.safetensors")
    refused(path, "this one is 'pca'", basis_name=str(tmp_path / "pca.safetensors"))
    path.write_text("<scene>")
    refused(path, "is not XML")
    path.write_text(PAINT.replace("/>", ' version="3.0.0"/>'))
    refused(path, "is not a <scene>")
    refused(scene(tmp_path, PAINT, BALL, LIGHT), "has 0 sensors for 1 photographs")
    path = scene(tmp_path, SENSOR, SENSOR, SENSOR, PAINT, BALL, LIGHT)
    refused(path, "has 3 sensors for 2 photographs", GRAY, GRAY)
    path = scene(tmp_path, SENSOR, PAINT, BALL, '<emitter type="lamp"/>')
    refused(path, "scene.xml: Mitsuba: ")


def test_a_material_within_another_is_not_enough(mi, tmp_path):
    for wrapper in ("twosided", "mask"):
        outer = f'<bsdf type="{wrapper}" id="outer">{PAINT}</bsdf>'
        path = scene(tmp_path, SENSOR, outer, BALL.replace("paint", "outer"), LIGHT)
        refused(path, "no shape has the BSDF 'paint' itself; name the outermost one")
        setting = work.scene_setting(path, "outer")
        found = setting.load({"code": "0 " * 32, "basis": "neural"})
        assert work._bsdf(found, setting).id() == "outer"


def test_pictures_that_show_nothing_are_refused(mi, tmp_path):
    ones = np.ones((3, 2, 3), np.float32)
    recording = Recording(np.array([[0, 0], [0, 1], [1, 1]]), ones, ones, ones)
    picture = np.full((2, 2, 3), 0.5)
    picture[0, 1, 2] = np.nan
    kept = work._photograph(picture, recording)
    assert kept.values.tolist() == [[0.5] * 3] * 2
    assert kept.recording.pixels.tolist() == [[0, 0], [1, 1]]
    with pytest.raises(NacreError, match="every pixel of the material is black"):
        work._photograph(0.0 * picture, recording)
    with pytest.raises(NacreError, match="no pixel of the material is finite"):
        work._photograph(np.full((2, 2, 3), np.inf), recording)
    away = BALL.replace("<ref", '<point name="center" x="90" y="0" z="0"/><ref')
    path = scene(tmp_path, SENSOR, PAINT, away, LIGHT)
    refused(path, f"photograph 1: with {path}: no pixel shows the front of the material alone")


def test_a_picture_is_of_what_a_film_is_cropped_to(mi, tmp_path):
    crop = "".join(
        f'<integer name="crop_{name}" value="{value}"/>'
        for name, value in (("offset_x", 2), ("offset_y", 1), ("width", 5), ("height", 10))
    )
    path = scene(tmp_path, SENSOR.replace("<rfilter", f"{crop}<rfilter"), PAINT, BALL, LIGHT)
    found = work.scene_setting(path, "paint").load({"code": "0 " * 32, "basis": "neural"})
    assert work._cameras(found, [np.ones((20, 10, 3))], ["a.exr"], "") == [0]
    with pytest.raises(NacreError, match=r"a.exr: has 16 x 12 pixels; .* another shape, 5 x 10"):
        work._cameras(found, [GRAY], ["a.exr"], "scene")


@pytest.mark.parametrize("included", [True, False])
def test_plausible_materials_are_kept_where_readers_have_their_basis(included, monkeypatch):
    network = NeuralBrdf([Layer(np.zeros((6, 3), np.float32), np.full(3, 0.2, np.float32))])
    monkeypatch.setattr(work, "fit", lambda material, progress: network)
    monkeypatch.setattr(work, "refine", lambda network, *_, **settings: network)
    known = pretrained_basis() if included else random_basis()
    codes = np.zeros((COUNT, known.code_dim), np.float16)
    estimate = Estimate(known.decode(codes[0]), codes, 9, observed="pixels")
    found = work.Photographed(estimate, np.ones((1, 3)), 0.0, 1, ()).network()
    assert len(plausible(found)) == (COUNT if included else 0)


def test_what_is_read_is_red_green_and_blue(mi, tmp_path):
    path = tmp_path / "photo.exr"
    write_image(GRAY * [1.0, 2.0, 3.0], path)
    (read,) = work.read_photographs([path])
    np.testing.assert_allclose(read, GRAY * [1.0, 2.0, 3.0], rtol=1e-6)
    (tmp_path / "cut.exr").write_bytes(path.read_bytes()[:-40])
    layers = mi.Bitmap(
        np.ones((4, 4, 4), np.float32), mi.Bitmap.PixelFormat.MultiChannel, [*"RGBZ"]
    )
    layers.write(str(tmp_path / "depth.exr"))
    mi.Bitmap(np.ones((4, 4, 1), np.float32)).write(str(tmp_path / "gray.exr"))
    (tmp_path / "photo.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    for name, words in {
        "cut.exr": "cannot be decoded",
        "depth.exr": "expected the channels R, G and B alone, not 'B, G, R, Z'",
        "gray.exr": "expected the channels R, G and B alone, not 'Y'",
        "photo.png": "is not an OpenEXR image",
        "none.exr": "no such file",
    }.items():
        with pytest.raises(FormatError, match=words) as found:
            work.read_photographs([path, tmp_path / name])
        assert str(tmp_path / name) in str(found.value)
    with pytest.raises(NacreError, match="expected 1 to 8 photographs, not 0"):
        work.read_photographs([])


@pytest.mark.slow
def test_an_estimate_that_was_stopped_ends_as_one_that_was_not(mi, tmp_path, monkeypatch):
    monkeypatch.setattr(work, "ROUNDS", 2)
    setting = work.scene_setting(scene(tmp_path, SENSOR, LIGHT, PAINT, BALL), "paint")
    made = setting.load({"code": ", ".join(map(str, CODE))})
    path = mi.load_dict({"type": "path"})
    picture = np.array(mi.render(made, integrator=path, spp=64))[..., :3]
    whole = work.estimate_from_photographs([picture], setting)
    assert whole.rounds == 2
    state = tmp_path / "paint.state"

    def stop(stage: str, done: int, total: int, text: str) -> None:
        if stage == "recording" and done == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        work.estimate_from_photographs([picture], setting, state=state, progress=stop)
    assert state.exists()
    with pytest.raises(NacreError, match=r"paint\.state: belongs to another run; remove it"):
        work.estimate_from_photographs([picture + 0.1], setting, state=state)
    begun: list[int] = []
    resumed = work.estimate_from_photographs(
        [picture],
        setting,
        state=state,
        progress=lambda stage, done, *_: begun.append(done) if stage == "recording" else None,
    )
    assert min(begun) == 1
    np.testing.assert_array_equal(resumed.estimate.material.code, whole.estimate.material.code)
    assert resumed.rounds == whole.rounds
