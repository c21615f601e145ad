"""Scenes of every kind are rendered as Mitsuba does, into the channels that Mitsuba writes."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nacre.errors import FormatError, NacreError
from nacre.mitsuba import passes, scene_rendering
from nacre.mitsuba.scene_file import SceneChanges
from nacre.mitsuba.scene_rendering import SceneRendering, render_file
from tests.tiers import tiered
from tests.variants import USUAL

from . import scenes
from .scenes import aov, integrator, pixels

KINDS = {
    f"{group}: {name}": text
    for group, cases in {
        "integrator": scenes.INTEGRATORS,
        "film": scenes.FILMS,
        "sensor": scenes.SENSORS,
        "sampler": scenes.SAMPLERS,
        "medium": scenes.MEDIA,
        "emitter": scenes.EMITTERS,
    }.items()
    for name, text in cases.items()
}
ALWAYS = {
    *(name for name in KINDS if name.startswith(("integrator", "sensor"))),
    *(f"film: {name}" for name in ("luminance float16", "rgba uint32", "xyz float32", "cropped")),
    *("film: aov in luminance_alpha float16", "film: aov in rgba uint32", "sampler: stratified"),
    *("medium: isotropic", "medium: heterogeneous", "emitter: envmap", "emitter: directionalarea"),
}
"""Kinds of scenes that are always rendered."""


def assert_equal_to_mitsuba(mi: Any, folder: Path, text: str, exactly: bool = True) -> None:
    """The file that nacre writes of a scene is the one that Mitsuba's film writes."""
    path = folder / "scene.xml"
    path.write_text(text)
    scene = mi.load_file(str(path))
    mi.render(scene, seed=5)
    film = scene.sensors()[0].film()
    if "rgbe" in text:  # the film would choose another ending
        film.bitmap().write(str(folder / "theirs.exr"))
    else:
        film.write(str(folder / "theirs.exr"))
    rendering = SceneRendering(path, seed=5)
    assert list(rendering.passes()) == [1.0]
    rendering.finished().write(folder / "ours.exr")
    theirs, ours = (mi.Bitmap(str(folder / f"{name}.exr")) for name in ("theirs", "ours"))
    assert [field.name for field in ours.struct_()] == [field.name for field in theirs.struct_()]
    assert np.array(ours).dtype == np.array(theirs).dtype
    if exactly:
        np.testing.assert_array_equal(np.array(ours), np.array(theirs))
    else:
        np.testing.assert_allclose(np.array(ours), np.array(theirs), rtol=2e-3, atol=1e-3)
    assert np.array(ours, np.float64).any()


@pytest.mark.parametrize("name", tiered(KINDS, ALWAYS))
def test_pictures_are_mitsubas(scalar: Any, tmp_path: Path, name: str) -> None:
    scenes.write_files(tmp_path, scalar)
    assert_equal_to_mitsuba(scalar, tmp_path, KINDS[name])


@pytest.mark.slow
@pytest.mark.parametrize("name", KINDS)
def test_pictures_are_mitsubas_where_it_compiles(rgb: Any, tmp_path: Path, name: str) -> None:
    scenes.write_files(tmp_path, rgb)
    assert_equal_to_mitsuba(rgb, tmp_path, KINDS[name])


@pytest.mark.parametrize("name", tiered(scenes.ADJOINT_INTEGRATORS, {"prb"}))
def test_pictures_of_adjoint_integrators_are_mitsubas(rgb: Any, tmp_path: Path, name: str) -> None:
    assert_equal_to_mitsuba(rgb, tmp_path, scenes.ADJOINT_INTEGRATORS[name])
    media = scenes.MEDIA["heterogeneous"].replace('"volpath"', f'"{name}"')
    if name == "prbvolpath":
        scenes.write_files(tmp_path, rgb)
        assert_equal_to_mitsuba(rgb, tmp_path, media)


def test_bands_of_a_spectral_film_are_mitsubas(spectral: Any, tmp_path: Path) -> None:
    assert_equal_to_mitsuba(spectral, tmp_path, scenes.SPECTRAL_FILM)
    path = tmp_path / "scene.xml"
    with pytest.raises(NacreError, match=r"holds bands, which are no colors: write an \.exr"):
        render_file(path)
    rendering = SceneRendering(path, 1)
    assert list(rendering.passes()) == [1.0]
    with pytest.raises(NacreError, match="film holds z_red, blue, which are no colors"):
        rendering.picture().write(tmp_path / "bands.png")


def test_stokes_vectors_are_mitsubas(polarized: Any, tmp_path: Path) -> None:
    text = scenes.scene(integrator("stokes", scenes.PATH))
    assert_equal_to_mitsuba(polarized, tmp_path, text)


def test_a_film_that_shares_samples_between_pixels_differs_by_rounding(
    rgb: Any, tmp_path: Path
) -> None:
    assert_equal_to_mitsuba(rgb, tmp_path, scenes.scene().replace("box", "gaussian"), exactly=False)


@pytest.mark.parametrize("kind", ["luminance", "luminance_alpha", "rgba", "xyz", "xyza"])
def test_colors_are_those_of_an_rgb_film(scalar: Any, tmp_path: Path, kind: str) -> None:
    path = tmp_path / "scene.xml"
    path.write_text(scenes.scene(aov("d:depth"), filming=pixels("rgb", "float32")))
    expected = render_file(path)
    path.write_text(scenes.scene(aov("d:depth"), filming=pixels(kind, "float32")))
    if "luminance" in kind:
        expected = np.repeat(expected @ np.float32([[0.2126], [0.7152], [0.0722]]), 3, axis=-1)
    np.testing.assert_allclose(render_file(path), expected, atol=2e-3)


def test_a_picture_of_several_passes_and_bands_is_mitsubas_within_noise(
    scalar: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "scene.xml"
    path.write_text(scenes.scene(samples=96))
    whole = render_file(path)
    monkeypatch.setattr(scene_rendering, "WHOLE", 16 * 12 * 32)
    monkeypatch.setattr(passes, "_MAX_SAMPLES", 16 * 5 * 32)
    monkeypatch.setattr(scene_rendering, "PASS", 1)
    seen: list[float] = []
    parts = render_file(path, progress=seen.append)
    other = render_file(path, seed=1)
    assert len(seen) > 3
    assert seen[-1] == 1.0
    assert np.abs(parts - whole).mean() < 1.5 * np.abs(other - whole).mean()


DEFAULTS = """<scene version="3.0.0"><default name="wide" value="8"/><include filename="more.xml"/>
<integrator type="path"/>
<sensor type="perspective" id="front"><film type="hdrfilm"><integer name="width" value="$wide"/>
<integer name="height" value="4"/><rfilter type="tent"/></film></sensor>
<sensor type="orthographic" id="back"/></scene>"""
MORE = """<scene version="3.0.0"><default name="light" value="1"/>
<emitter type="constant"><rgb name="radiance" value="$light"/></emitter></scene>"""


@pytest.fixture
def defaults(scalar: Any, tmp_path: Path) -> Path:
    (tmp_path / "more.xml").write_text(MORE)
    (tmp_path / "scene.xml").write_text(DEFAULTS)
    return tmp_path / "scene.xml"


def test_parameters_sensors_and_sizes_are_chosen(defaults: Path) -> None:
    assert render_file(defaults, 1).shape == (4, 8, 3)
    bright = render_file(defaults, 1, parameters={"light": "3", "wide": "2"})
    assert bright.shape == (4, 2, 3)
    np.testing.assert_allclose(bright, 3.0, rtol=1e-3)
    assert render_file(defaults, 1, width=16).shape == (8, 16, 3)
    assert render_file(defaults, 1, height=6).shape == (6, 12, 3)
    assert render_file(defaults, 1, width=5, height=7).shape == (7, 5, 3)
    assert render_file(defaults, 1, sensor="back", width=4).shape == (3, 4, 3)
    assert render_file(defaults, 1, sensor=1, width=4).shape == (3, 4, 3)


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        (
            SceneChanges({"wid": "2"}),
            r"no parameter 'wid' \(found: light, wide\); did you mean wide",
        ),
        (SceneChanges({"wide": "much"}), "much"),
        (SceneChanges(sensor="top"), r"no sensor 'top' \(found: 0 front, 1 back\)"),
        (SceneChanges(sensor=2), "no sensor 2"),
    ],
)
def test_wrong_choices_are_answered_with_what_there_is(
    defaults: Path, changes: SceneChanges, complaint: str
) -> None:
    with pytest.raises(FormatError, match=complaint) as caught:
        SceneRendering(defaults, changes=changes)
    assert "\n" not in str(caught.value)


def test_a_crop_window_stays_where_it_is(scalar: Any, tmp_path: Path) -> None:
    path = tmp_path / "scene.xml"
    path.write_text(scenes.FILMS["cropped"])
    assert render_file(path, width=32, height=24).shape == (5, 7, 3)
    with pytest.raises(NacreError, match="crop"):
        render_file(path, width=4, height=4)


def test_variants_are_chosen_for_one_picture(rgb: Any, tmp_path: Path) -> None:
    path = tmp_path / "scene.xml"
    path.write_text(scenes.SPECTRAL_FILM)
    with pytest.raises(FormatError, match=r"variant llvm_ad_spectral does$") as caught:
        render_file(path)
    assert "\n" not in str(caught.value)
    path.write_text(scenes.scene(integrator("stokes", scenes.PATH)))
    with pytest.raises(FormatError, match=r"variant llvm_ad_spectral_polarized does$"):
        render_file(path)
    path.write_text(scenes.scene())
    picture = render_file(path, variant="scalar_rgb")
    assert picture.shape == (12, 16, 3)
    assert rgb.variant() == USUAL
    with pytest.raises(NacreError, match=r"no variant 'scalar_rbg' \(it has .*did you mean scalar"):
        render_file(path, variant="scalar_rbg")


def test_what_mitsuba_cannot_render_is_told_in_a_line(scalar: Any, tmp_path: Path) -> None:
    path = tmp_path / "scene.xml"
    path.write_text(scenes.SENSORS["radiancemeter"].replace(scenes.PIXEL, scenes.SIZE))
    with pytest.raises(NacreError, match=r"scene\.xml: Mitsuba: .*1x1") as caught:
        render_file(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("kind", "given"),
    tiered(product(("rgb", "luminance", "xyza"), (False, True)), {("rgb", True), ("xyza", False)}),
)
def test_noise_is_removed(rgb: Any, tmp_path: Path, kind: str, given: bool) -> None:
    pytest.importorskip("pyoidn")
    path = tmp_path / "scene.xml"
    asked = "d:depth,a:albedo,n:sh_normal" if given else "d:depth"
    text = scenes.scene(aov(asked), filming=pixels(kind, "float32")).replace("box", "gaussian")
    path.write_text(text)
    expected = render_file(path, spp=512)
    rendering = SceneRendering(path, spp=8, denoise=True)
    assert list(rendering.passes()) == [1.0]
    noisy, clean = rendering.picture(), rendering.finished()
    errors = [np.abs(p.colors - expected)[2:-2, 2:-2].mean() for p in (clean, noisy)]
    assert errors[0] < 0.9 * errors[1]
    count = len(kind) if kind != "luminance" else 1
    np.testing.assert_array_equal(clean.values[..., count:], noisy.values[..., count:])
