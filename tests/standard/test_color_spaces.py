"""Color spaces of files, against colour-science and the transforms that MaterialX ships."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.errors import FormatError
from nacre.standard.files.color_spaces import to_rec_709
from tests.oracles.runners.materialx import library

COLORS = (0.9, 0.8, 0.7), (0.02, 0.5, 1.0), (1.3, 0.0, 0.2)
CIF = (
    *("lin_ap1_scene", "lin_ap0_scene", "lin_rec709_scene", "lin_p3d65_scene", "lin_rec2020_scene"),
    *("lin_adobergb_scene", "srgb_rec709_scene", "g22_rec709_scene", "g18_rec709_scene"),
    *("srgb_ap1_scene", "g22_ap1_scene", "srgb_p3d65_scene", "g22_adobergb_scene"),
)


@pytest.mark.parametrize("space", CIF)
@pytest.mark.parametrize("color", COLORS)
def test_spaces_are_those_of_colour_science(space, color):
    colour = pytest.importorskip("colour", reason="needs colour-science")
    spaces = colour.RGB_COLOURSPACES
    expected = colour.RGB_to_RGB(
        color,
        spaces[space],
        spaces["lin_rec709_scene"],
        chromatic_adaptation_transform="Bradford",
        apply_cctf_decoding=True,
    )
    # That package rounds the exponent 563 / 256 of Adobe RGB to 2.2; USD and MaterialX do not.
    tolerance = 1e-3 if space == "g22_adobergb_scene" else 5e-5
    np.testing.assert_allclose(to_rec_709(color, space), expected, atol=tolerance)


SHIPPED = (
    *("g18_rec709", "g22_rec709", "rec709_display", "acescg", "g22_ap1", "srgb_texture"),
    *("lin_adobergb", "adobergb", "srgb_displayp3", "lin_displayp3"),
)


def _shipped(space: str, color: tuple[float, ...]) -> np.ndarray:
    """What the numbers in MaterialX's graph of a transform give, by hand."""
    graph = library().getNodeGraph(f"NG_{space}_to_lin_rec709_color3")
    values = np.array(color)
    nodes = {node.getName(): node for node in graph.getNodes()}
    if "gamma" in nodes:
        exponent = nodes["gamma"].getInput("in2").getValue()
        values = np.maximum(values, 0.0) ** (563.0 / 256.0 if exponent is None else exponent)
    if space.startswith("srgb"):
        values = np.where(values > 0.04045, ((values + 0.055) / 1.055) ** 2.4, values / 12.92)
    for name in ("mat", "rec709"):
        if name in nodes and nodes[name].getCategory() == "constant":
            text = nodes[name].getInput("value").getValueString()
            values = values @ np.array([float(x) for x in text.split(",")]).reshape(3, 3)
        elif name in nodes:
            values = _shipped(nodes[name].getCategory().split("_to_")[0], values)
    return values


@pytest.mark.parametrize("space", SHIPPED)
@pytest.mark.parametrize("color", COLORS)
def test_spaces_are_those_of_materialx(space, color):
    pytest.importorskip("MaterialX", reason="needs MaterialX")
    expected = _shipped(space, color)
    np.testing.assert_allclose(to_rec_709(color, space), expected, atol=5e-5)


def test_every_transform_that_materialx_ships_is_known():
    pytest.importorskip("MaterialX", reason="needs MaterialX")
    found = {
        node.getName().split("_to_")[0].removeprefix("ND_")
        for node in library().getNodeDefs()
        if node.getNodeGroup() == "colortransform"
    }
    assert found == set(SHIPPED)


@pytest.mark.parametrize("space", [*CIF, *SHIPPED])
def test_white_is_white(space):
    np.testing.assert_allclose(to_rec_709((1.0, 1.0, 1.0), space), 1.0, atol=2e-4)


def test_xyz_of_daylight_is_white():
    xyz = 0.3127 / 0.3290, 1.0, (1.0 - 0.3127 - 0.3290) / 0.3290
    np.testing.assert_allclose(to_rec_709(xyz, "lin_ciexyzd65_scene"), 1.0, atol=1e-6)


@pytest.mark.parametrize("space", ["", "none", "raw", "data", "lin_rec709", "LIN_REC709_SCENE"])
def test_what_is_linear_rec_709_stays(space):
    np.testing.assert_array_equal(to_rec_709((0.1, -0.2, 1.7), space), (0.1, -0.2, 1.7))


@pytest.mark.parametrize("space", ["srgb_texture", "g22_rec709", "adobergb"])
def test_encoded_values_below_zero_have_a_meaning(space):
    assert np.isfinite(to_rec_709((-0.2, -1e300, 0.1), space)).all()


@pytest.mark.parametrize(
    "space", ["acescc", "lin_", "g220_rec709", "srgb_texture_linear", "x" * 99]
)
def test_an_unknown_space_is_named(space):
    with pytest.raises(FormatError, match="is none of those read: acescg, srgb_texture"):
        to_rec_709((1.0, 1.0, 1.0), space)
