"""One material of a texture, and a texture of one material."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.analytic.lambert import Lambert
from nacre.btf import TableBtf
from nacre.errors import FormatError
from nacre.formats import load_brdf
from nacre.measured.textures import BONN
from nacre.textures import LatentMap, save_latent_map
from nacre.textures.uniform import TexelBrdf, average, material_of, tile
from tests.textures.codecs.basis.made import codec
from tests.textures.support import ByImage

WI, WO = (w[::500] for w in BONN.pairs())


def made() -> TableBtf:
    values = np.random.default_rng(0).random((5, 7, len(WI), 3)).astype(np.float16)
    return TableBtf(values, WI, WO, "made")


def test_a_mean_is_that_of_all_texels_read_by_texel_or_by_image() -> None:
    wanted = made().values.astype(np.float64).mean((0, 1))
    for texture in (made(), ByImage(made())):
        mean = average(texture)
        assert mean.values.shape == (1, 1, len(WI), 3)
        assert mean.name == "made"
        np.testing.assert_allclose(mean.values[0, 0], wanted, rtol=1e-6)


def test_a_material_is_tiled_everywhere() -> None:
    texture = tile(Lambert(diffuse=(0.2, 0.4, 0.8)), WI, WO, 30, 20)
    assert (texture.width, texture.height) == (30, 20)
    assert texture.values.base is not None  # no copies
    np.testing.assert_allclose(texture.images([3])[0, 7, 9], (0.2, 0.4, 0.8), rtol=1e-6)
    np.testing.assert_array_equal(average(texture).values[0, 0], texture.values[0, 0])
    with pytest.raises(ValueError, match="0 x 1 texels"):
        tile(Lambert(diffuse=(1.0, 1.0, 1.0)), WI, WO, 0)


def test_an_encoded_texel_is_a_material(tmp_path) -> None:
    made_codec = codec()
    codes = np.array([[[0.3, -0.2]]], np.float32)
    save_latent_map(LatentMap(codes, made_codec, WI, WO, "made"), tmp_path / "one.safetensors")
    brdf = load_brdf(tmp_path / "one.safetensors")
    assert isinstance(brdf, TexelBrdf)
    assert (brdf.name, brdf.nbytes, brdf.isotropic) == ("made", 8, False)
    wanted = made_codec.decoder(WI, WO)(codes[0]) / np.pi
    np.testing.assert_allclose(brdf.eval(WI, WO), wanted[0], rtol=1e-5, atol=1e-7)
    assert not brdf.eval([0.6, 0.0, -0.8], [0.0, 0.0, 1.0]).any()


def test_a_texture_of_several_texels_is_no_material(tmp_path) -> None:
    latent = LatentMap(np.zeros((2, 3, 2), np.float32), codec(), WI, WO)
    with pytest.raises(ValueError, match="3 x 2 texels"):
        material_of(latent)
    save_latent_map(latent, tmp_path / "more.safetensors")
    with pytest.raises(FormatError, match=r"3 x 2 texels, not one material; nacre btf average"):
        load_brdf(tmp_path / "more.safetensors")
    whole = (tmp_path / "more.safetensors").read_bytes()
    (tmp_path / "part.safetensors").write_bytes(whole[:-9])
    with pytest.raises(FormatError, match="not a whole safetensors file") as caught:
        load_brdf(tmp_path / "part.safetensors")
    assert str(caught.value).count("part.safetensors") == 1
    assert "nacre btf" not in str(caught.value)
