"""`nacre render` of Mitsuba scenes; of materials see the tests of commands and of textures."""

from __future__ import annotations

import signal
from pathlib import Path

import numpy as np
import pytest

import nacre
from tests.cli.support import assert_refused, run, run_json
from tests.reflectances import Glossy
from tests.specimens import SPECIMENS
from tests.variants import require_mitsuba

SCENE = """<scene version="3.0.0">
  <integrator type="path"/>
  <sensor type="perspective">
    <transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
    <sampler type="independent"><integer name="sample_count" value="4"/></sampler>
    <film type="hdrfilm">
      <integer name="width" value="24"/><integer name="height" value="16"/>
    </film>
  </sensor>
  <emitter type="constant"/>
  <shape type="sphere">
    <bsdf type="brdf"><string name="filename" value="gold.binary"/></bsdf>
  </shape>
</scene>"""


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    require_mitsuba()
    monkeypatch.chdir(tmp_path)
    nacre.save(Glossy(0.2, 0.5, 0.3), "gold.binary")
    Path("ball.xml").write_text(SCENE)
    return tmp_path


def test_a_scene_that_uses_our_plugins_is_rendered(here, capsys):
    import mitsuba as mi

    found = run_json(capsys, "render", "ball.xml", "--spp", 2, "-o", "x.exr")
    assert found == {"output": "x.exr", "width": 24, "height": 16}
    picture = np.array(mi.Bitmap("x.exr"))
    assert 0.05 < picture[8, 12].mean() < 1.0
    np.testing.assert_allclose(picture[0, 0], 1.0, rtol=1e-3)
    assert run("render", "ball.xml") == 0
    assert capsys.readouterr().out == "ball.png: 24 x 16 pixels\n"


def test_options_for_materials_are_refused_for_scenes(here, capsys):
    for option in (("--shape", "ball"), ("--frames", 3), ("--angle", 20)):
        words = f"{option[0]} is for materials; ball.xml"
        assert_refused(capsys, words, "render", "ball.xml", *option)
    Path("bad.xml").write_text("<scene>")
    assert_refused(capsys, "bad.xml: is not XML", "render", "bad.xml")


def test_options_for_scenes(here, capsys):
    import mitsuba as mi

    Path("wide.xml").write_text(
        SCENE.replace('value="24"', 'value="$wide"').replace(
            "<integrator", '<default name="wide" value="24"/><integrator'
        )
    )
    for size, options in {
        "9 x 16": ("-D", "wide=9"),
        "12 x 8": ("--size", 12),
        "12 x 20": ("--size", "12x20"),
        "36 x 24": ("--height", 24, "--sensor", 0),
    }.items():
        call = ("render", "wide.xml", *options, "--variant", "scalar_rgb", "-o", "x.exr")
        assert run(*call) == 0
        assert capsys.readouterr().out == f"x.exr: {size} pixels\n"
        assert " x ".join(map(str, mi.Bitmap("x.exr").size())) == size
    for words, options in {
        "wide.xml: has no parameter 'width' (found: wide)": ("-D", "width=9"),
        "--define: 'wide': expected a name and a value, like width=640": ("-D", "wide"),
        "wide.xml: has no sensor '1' (found: 0 perspective)": ("--sensor", 1),
        "Mitsuba has no variant 'rgb' (it has scalar_rgb,": ("--variant", "rgb"),
        "--size: '9x': expected a width, or a width and a height": ("--size", "9x"),
    }.items():
        assert_refused(capsys, words, "render", "wide.xml", *options)
    words = "--sensor is for Mitsuba scenes (.xml); gold.binary is a material"
    assert_refused(capsys, words, "render", "gold.binary", "--sensor", 1)


def test_an_interrupt_leaves_the_picture_so_far(here, capsys, monkeypatch):
    import mitsuba as mi

    from nacre.mitsuba import scene_rendering

    render = mi.render

    def interrupted(*arguments, **options):
        signal.raise_signal(signal.SIGINT)
        return render(*arguments, **options)

    monkeypatch.setattr(mi, "render", interrupted)
    for name in ("WHOLE", "PASS"):
        monkeypatch.setattr(scene_rendering, name, 1)
    assert run("render", "ball.xml", "-o", "x.exr", quiet=False) == 130
    error = capsys.readouterr().err
    assert "x.exr: the picture so far, 1 of 4 samples per pixel\n" in error
    assert error.endswith("nacre: interrupted\n")
    assert 0.05 < np.array(mi.Bitmap("x.exr"))[8, 12].mean() < 1.0


def test_a_radiance_file_is_a_material_not_a_scene(here, capsys):
    Path("paint.xml").write_bytes(SPECIMENS["Radiance BSDF"].files()[0])
    options = ("--size", 16, "--spp", 1, "--no-denoise", "-o", "x.exr")
    assert run("render", "paint.xml", *options) == 0
    assert Path("x.exr").is_file()
