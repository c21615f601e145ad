"""The plugins `neuralbtf` and `measuredbtf` in scenes, and what they refuse."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nacre
from nacre import textures
from nacre.errors import FormatError, NacreError
from nacre.mitsuba.textures.plugins import texture_bsdf
from nacre.mitsuba.textures.scene import GEOMETRIES, describe_texture_scene, texture_scale
from nacre.textures.codecs.principal import PcaCodec
from tests.specimens import encoded
from tests.textures.codecs.basis.made import codec as basis_codec

from .made import FlatCodec, latent, picture


def test_scenes_in_xml_find_files_beside_them(rgb: Any, tmp_path: Path) -> None:
    codes = np.random.default_rng(1).normal(size=(2, 5, 2))
    textures.save_latent_map(latent(codes, basis_codec(1)), tmp_path / "cloth.safetensors")
    nacre.save(picture(np.full((3, 2, 3), 0.5)), tmp_path / "gray.npz")
    (tmp_path / "scene.xml").write_text(
        """<scene version="3.0.0">
        <integrator type="path"/><emitter type="constant"/>
        <shape type="sphere"><bsdf type="neuralbtf">
            <string name="filename" value="cloth.safetensors"/>
            <integer name="resolution" value="4"/>
            <transform name="to_uv"><scale x="4" y="2"/></transform>
        </bsdf></shape>
        <shape type="sphere"><bsdf type="measuredbtf">
            <string name="filename" value="gray.npz"/>
        </bsdf></shape></scene>"""
    )
    scene = rgb.load_file(str(tmp_path / "scene.xml"))
    shown = [str(shape.bsdf()) for shape in scene.shapes()]
    assert "width = 5" in shown[0]
    assert "TableDecoder" in shown[0]
    assert "MeasuredDecoder" in shown[1]


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_textures_are_upright(rgb: Any, geometry: str) -> None:
    pixels = np.zeros((2, 2, 3))
    pixels[0, :, 0], pixels[1, :, 1] = 1.0, 1.0  # red above green
    to_uv = texture_scale(geometry, 2)
    bsdf = texture_bsdf(picture(pixels), interpolation="nearest", to_uv=to_uv)
    scene = describe_texture_scene(bsdf, geometry, "directional", (48, 48), 20.0)
    image = np.array(rgb.render(rgb.load_dict(scene), spp=8))
    column = image[:, 24]
    red, green = (column[:, k] > 4.0 * column[:, 1 - k] for k in (0, 1))
    assert red.any()
    assert green.any()
    kinds = [k for k in np.where(red, 1, np.where(green, 2, 0)) if k]
    changes = [k for i, k in enumerate(kinds) if i == 0 or kinds[i - 1] != k]
    assert changes[:2] == [1, 2]


def written(tmp_path: Path, change: Any) -> str:
    """A file of an encoded texture with something changed."""
    tensors, header = encoded._tensors(), encoded._header()
    change(tensors, header)
    path = tmp_path / "changed.safetensors"
    path.write_bytes(encoded._bytes(tensors, header))
    return str(path)


def test_files_that_do_not_fit_are_refused(rgb: Any, tmp_path: Path) -> None:
    def three_values(tensors: Any, header: Any) -> None:
        tensors["codes"] = np.zeros((2, 3, 3), "<f4")

    def empty(tensors: Any, header: Any) -> None:
        tensors["codes"] = np.zeros((0, 3, 2), "<f4")

    def later(tensors: Any, header: Any) -> None:
        header["codec"]["version"] = 99

    for change, words in (
        (three_values, r"codes are \(2, 3, 3\), expected \(height, width, 2\)"),
        (empty, r"\(0, 3, 2\)"),
        (later, "version 99; this nacre reads"),
    ):
        with pytest.raises((RuntimeError, FormatError), match=words):
            rgb.load_dict({"type": "neuralbtf", "filename": written(tmp_path, change)})
    with pytest.raises((RuntimeError, FormatError), match="give it the property 'filename'"):
        rgb.load_dict({"type": "neuralbtf"})


def test_options_out_of_range_are_refused(rgb: Any, tmp_path: Path) -> None:
    source, table = latent(np.ones((3, 4, 3)), FlatCodec()), picture(np.ones((2, 2, 3)))
    nothing = rgb.ScalarTransform4f(np.diag([1.0, 0.0, 1.0, 1.0]))
    for made, options, words in (
        (source, {"decoder": "magic"}, "decoder is one of table, network; got 'magic'"),
        (source, {"interpolation": "cubic"}, "interpolation is one of"),
        (source, {"resolution": 1}, "resolution must be a number of 2 or more; got 1"),
        (source, {"resolution": 40, "memory": 8}, r"needs 547 MiB, 8 are allowed; lower the reso"),
        (table, {"depth": 0.1}, "height_field and depth belong together"),
        (table, {"height_field": "x.png"}, "height_field and depth belong together"),
        (table, {"to_uv": nothing}, "to_uv: leaves nothing of the texture"),
        (
            table,
            {"height_field": str(tmp_path / "missing.png"), "depth": 0.1},
            "missing.png: no such file",
        ),
    ):
        with pytest.raises(NacreError, match=words):
            texture_bsdf(made, **options)
    with pytest.raises(NacreError, match="repeated at least once, not 0"):
        texture_scale("plane", 0)


def test_principal_components_are_refused(rgb: Any) -> None:
    up = np.array([[0.0, 0.0, 1.0]], np.float32)
    codec = PcaCodec(up, up, np.zeros((1, 3)), np.ones((1, 1, 3)), np.ones(1), 1.0)
    with pytest.raises(NacreError, match="own directions only; decode it"):
        texture_bsdf(latent(np.ones((2, 2, 1)), codec))


def test_variants_that_do_not_compile_are_refused(scalar: Any) -> None:
    with pytest.raises(NacreError, match="needs a variant that compiles, got scalar_rgb"):
        texture_bsdf(picture(np.ones((2, 2, 3))))
