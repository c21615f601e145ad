"""`nacre render` of Mitsuba scenes; of materials see the tests of commands and of textures."""

from __future__ import annotations

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
    for option in (("--shape", "ball"), ("--frames", 3), ("--size", 9), ("--no-denoise",)):
        name = str(option[0]).replace("--no-", "--")
        assert_refused(capsys, f"{name} is for materials; ball.xml", "render", "ball.xml", *option)
    Path("bad.xml").write_text("<scene>")
    assert_refused(capsys, "bad.xml: is not XML", "render", "bad.xml")


def test_a_radiance_file_is_a_material_not_a_scene(here, capsys):
    Path("paint.xml").write_bytes(SPECIMENS["Radiance BSDF"].files()[0])
    options = ("--size", 16, "--spp", 1, "--no-denoise", "-o", "x.exr")
    assert run("render", "paint.xml", *options) == 0
    assert Path("x.exr").is_file()
