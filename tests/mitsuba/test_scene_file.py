"""Scene files: rendered with nacre's plugins, refused where Mitsuba would end the process."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.errors import FormatError, NacreError
from nacre.mitsuba.scene_file import load_scene, scene_bsdfs
from nacre.mitsuba.scene_rendering import render_file

from .reflectances import network

SCENE = """<scene version="3.0.0">
<integrator type="path"/>
<sensor type="orthographic"><film type="hdrfilm"><integer name="width" value="12"/>
<integer name="height" value="8"/><rfilter type="box"/><string name="pixel_format" value="rgb"/>
</film><sampler type="independent"><integer name="sample_count" value="8"/></sampler>
<transform name="to_world"><lookat origin="0,0,3" target="0,0,0" up="0,1,0"/></transform></sensor>
<emitter type="constant"/>
<shape type="sphere"><bsdf type="nbrdf"><string name="filename" value="a.safetensors"/></bsdf>
</shape></scene>"""


@pytest.fixture
def scene(rgb: Any, tmp_path: Path) -> Path:
    nacre.save(network(1), tmp_path / "a.safetensors")
    (tmp_path / "scene.xml").write_text(SCENE)
    return tmp_path / "scene.xml"


def test_a_scene_with_nacre_plugins_is_rendered(scene: Path) -> None:
    seen: list[float] = []
    picture = render_file(scene, progress=seen.append)
    assert picture.shape == (8, 12, 3)
    assert picture.dtype == np.float32
    assert picture[3:5, 5:7].mean() > 0.05
    assert seen == [1.0]
    np.testing.assert_allclose(render_file(scene, spp=8), picture, rtol=1e-5)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        *(('value="rgb"', f'value="{kind}"') for kind in ("rgba", "xyz", "xyza")),
        ('value="rgb"', 'value="luminance_alpha"'),
        (
            '<integrator type="path"/>',
            '<integrator type="aov"><string name="aovs" value="d:depth,n:sh_normal"/>'
            '<integrator type="path"/></integrator>',
        ),
        (
            '<integrator type="path"/>',
            '<integrator type="moment"><integrator type="path"/></integrator>',
        ),
    ],
    ids=["rgba", "xyz", "xyza", "luminance_alpha", "aov", "moment"],
)
def test_films_and_integrators_of_other_channels_give_the_colors(
    scene: Path, old: str, new: str
) -> None:
    expected = render_file(scene)
    scene.write_text(SCENE.replace(old, new))
    found = render_file(scene)
    if "luminance" in new:
        expected = np.repeat(expected @ np.float32([[0.2126], [0.7152], [0.0722]]), 3, axis=-1)
    np.testing.assert_allclose(found, expected, atol=2e-3)


def test_a_film_without_colors_is_refused(scene: Path) -> None:
    band = '<spectrum name="band1" value="400:0.5, 700:0.5"/>'
    film = f'<film type="specfilm">{band}<integer name="width" value="4"/>'
    scene.write_text(SCENE.replace('<film type="hdrfilm"><integer name="width" value="12"/>', film))
    with pytest.raises(NacreError):
        render_file(scene)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("<scene", "is not XML"),
        ('<scene version="3.0.0"/>', "has no sensor"),
        ('<bsdf version="3.0.0" type="diffuse"/>', "is not a <scene> but a "),
        ('<scene version="3.0.0"><bsdf type="nosuch"/></scene>', "Mitsuba: .*nosuch"),
        (
            '<scene version="3.0.0"><bsdf type="brdf"><string name="filename" value="absent.bsdf"/>'
            "</bsdf></scene>",
            r'line 1.*"brdf": absent\.bsdf: ',
        ),
    ],
)
def test_what_is_no_scene_is_refused_in_a_line(
    rgb: Any, tmp_path: Path, text: str, complaint: str
) -> None:
    path = tmp_path / "bad.xml"
    path.write_text(text)
    with pytest.raises(NacreError, match=complaint) as caught:
        render_file(path)
    assert "\n" not in str(caught.value)
    assert "Traceback" not in str(caught.value)
    with pytest.raises(FormatError, match="no such file"):
        load_scene(tmp_path / "absent.xml")


def test_bsdfs_on_shapes_and_on_none_are_found(rgb: Any, scene: Path, tmp_path: Path) -> None:
    assert len(scene_bsdfs(scene)) == 1
    loose = tmp_path / "loose.xml"
    loose.write_text(
        """<scene version="3.0.0"><bsdf type="roughconductor" id="metal"/>
        <bsdf type="diffuse" id="paint"/>
        <bsdf type="twosided" id="both"><bsdf type="plastic" id="inner"/></bsdf>
        <shape type="sphere"><ref id="paint"/></shape></scene>"""
    )
    assert sorted(bsdf.id() for bsdf in scene_bsdfs(loose)) == ["both", "metal", "paint"]
    alone = tmp_path / "alone.xml"
    alone.write_text('<bsdf version="3.0.0" type="plastic" id="it"/>')
    assert [bsdf.id() for bsdf in scene_bsdfs(alone)] == ["it"]
