"""Small inputs like those of public projects, each with what is expected of it in its README."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.formats import materials_in
from tests.data import require_data


def case(*names: str) -> Path:
    return require_data("cases", *names)


def albedo(brdf: nacre.Brdf, degrees: float = 20.0) -> float:
    t = math.radians(degrees)
    return float(brdf.albedo([math.sin(t), 0.0, math.cos(t)])[1])


def test_a_table_with_columns_of_other_names() -> None:
    scan = nacre.load(case("csv_unknown_columns", "goniometer.csv"))
    assert scan.wavelengths.tolist() == [550.0]
    assert any("theta_i=Incident_angle" in note for note in scan.notes)


def test_two_materials_without_names() -> None:
    path = case("gltf_unnamed", "two_unnamed.gltf")
    assert materials_in(path) == ("", "")
    assert nacre.load(path, material="2") != nacre.load(path, material="1")
    with pytest.raises(nacre.FormatError, match="number from 1 to 2"):
        nacre.load(path)


def test_a_klems_matrix() -> None:
    matrix = nacre.load(case("klems_matrix", "klems.xml"))
    assert matrix.eval([0.6, 0.0, 0.8], [0.0, 0.6, 0.8]) == pytest.approx([0.2] * 3, rel=1e-5)
    assert albedo(matrix) == pytest.approx(0.628, abs=2e-3)


@pytest.mark.parametrize("name", ["acescg.mtlx", "acescg_in_gamut.mtlx"])
def test_colors_in_acescg(name: str) -> None:
    color = nacre.load(case("openpbr_acescg", name)).values["base_color"]
    assert color == pytest.approx((0.978, 0.788, 0.682), abs=2e-3)


def test_an_empty_input_is_none() -> None:
    assert nacre.load(case("openpbr_empty_displacement", "empty.mtlx")).model == "openpbr"


def test_a_polarized_file_says_so() -> None:
    assert "Mueller" in nacre.load(case("pbsdf_message", "small.pbsdf")).notes[0]


def test_a_line_of_another_tool_is_skipped() -> None:
    clean, leading = (
        nacre.load(case("radiance_leading_line", f"{name}.xml")) for name in ("clean", "leading")
    )
    assert albedo(leading) == albedo(clean) == pytest.approx(0.1 * math.pi, rel=0.02)


def test_transmission_that_is_left_out_is_named() -> None:
    brdf = nacre.load(case("radiance_transmission_silent", "both.xml"))
    assert "Transmission Back" in brdf.notes[0]
    assert albedo(brdf) == pytest.approx(0.1 * math.pi, rel=0.02)


def test_one_measurement_in_two_formats() -> None:
    speos = nacre.load(case("speos_anisotropic", "planesymmetric_MIT.anisotropicbsdf"))
    zemax = nacre.load(case("speos_anisotropic", "same_data_MIT.bsdf"))
    for degrees in (15.0, 45.0):
        light = _from_angles(degrees, 180.0)
        views = [_from_angles(t, p) for t in (5, 20, 35, 50) for p in (0, 40, 90, 170)]
        ratios = [speos.eval(light, view)[1] / zemax.eval(light, view)[1] for view in views]
        assert np.median(ratios) == pytest.approx(1.0, rel=0.05)


def _from_angles(theta: float, phi: float) -> list[float]:
    t, p = math.radians(theta), math.radians(phi)
    return [math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t)]


def test_versions_of_one_layout() -> None:
    eight, nine = (nacre.load(case("speos_v8", f"v{version}.brdf")) for version in (8, 9))
    np.testing.assert_array_equal(eight.spectra, nine.spectra)


def test_a_long_comment_changes_nothing() -> None:
    long, short = (
        nacre.load(case("zemax_long_comment", f"{name}.bsdf")) for name in ("long", "short")
    )
    assert len(long.samples) == 706
    np.testing.assert_array_equal(long.samples.rgb, short.samples.rgb)


def test_totals_mean_the_same_in_both_formats() -> None:
    zemax = nacre.load(case("zemax_tis", "tis.bsdf"))
    speos = nacre.load(case("zemax_tis", "percent.brdf"))
    assert albedo(zemax) == pytest.approx(0.5, rel=0.03)
    assert albedo(speos) == pytest.approx(0.5, rel=0.03)
    assert "15.9" in zemax.notes[0]


@pytest.mark.parametrize(
    "name",
    [
        "scene_aov/aov.xml",
        "scene_aov/moment.xml",
        "scene_rgba/rgba.xml",
        "scene_rgba/luminance_alpha.xml",
        "scene_rgba/xyz.xml",
    ],
)
def test_scenes_of_other_channels_are_gray_spheres(name: str) -> None:
    pytest.importorskip("mitsuba", reason="needs mitsuba")
    from nacre.mitsuba.scene_rendering import render_file

    picture = render_file(case(*name.split("/")), spp=32)
    assert picture.shape == (32, 32, 3)
    assert picture[14:18, 14:18].mean(axis=(0, 1)) == pytest.approx([0.5] * 3, abs=0.05)
    assert picture[0, 0] == pytest.approx([1.0] * 3, abs=1e-3)
