"""Tables of goniometers: any columns, as text or in spreadsheets."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.errors import FormatError
from nacre.measured.goniometer.columns import understood

LONG = "theta_in;theta_out;phi;wavelength;BRDF\n10;20;180;450;0.1\n10;20;180;650;0.3\n"


def write(path: Path, text: str, encoding: str = "utf-8") -> Path:
    path.write_text(text, encoding=encoding)
    return path


@pytest.mark.parametrize(
    ("names", "places"),
    [
        ("theta_i phi_i theta_o phi_o f", "theta_i phi_i theta_o phi_o f"),
        ("src_z src_a view_z view_a brf", "theta_i phi_i theta_o phi_o f"),
        ("Incident_angle Measure_angle BRDF", "theta_i theta_o f"),
        ("SZA SAA VZA VAA reflectance", "theta_i phi_i theta_o phi_o f"),
        ("SZA VZA RAA BRF", "theta_i theta_o phi f"),
        ("thetaIn phiIn thetaOut phiOut BSDF", "theta_i phi_i theta_o phi_o f"),
        ("AOI detector_theta detector_phi value", "theta_i theta_o phi_o f"),
        ("incidence emission azimuth brdf sigma", "theta_i theta_o phi f sigma"),
        ("theta-in theta-r lambda R", "theta_i theta_o wavelength r"),
        ("theta_i theta_v R G B", "theta_i theta_o r g b"),
    ],
)
def test_columns_are_known_by_their_names(names: str, places: str) -> None:
    said = {"f": "R"} if names.endswith("lambda R") else None
    found = understood(names.split(), said)
    expected = places.replace(" r", " f", 1).split() if said else places.split()
    if said:
        expected = ["theta_i", "theta_o", "wavelength", "f"]
    assert {role: found.places[role] for role in expected} == {
        role: k for k, role in enumerate(expected)
    }


@pytest.mark.parametrize(
    ("name", "band"),
    [
        ("550 nm", 550),
        ("1243.53nm", 1243.53),
        ("R_905nm", 905),
        ("0.9 um", 900),
        ("f(1.55 µm)", 1550),
        ("550", 550),
        ("L450", 450),
    ],
)
def test_bands_are_known_by_their_names(name: str, band: float) -> None:
    found = understood(["theta_i", "theta_o", name], None)
    assert list(found.bands) == [band]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "windows-1252"])
def test_any_text_is_read(tmp_path: Path, end: str, encoding: str) -> None:
    text = "Probe\tweiß\nGröße µm\t3\n" + LONG.replace(";", "\t")
    path = tmp_path / "scan.txt"
    path.write_bytes(text.replace("\n", end).encode(encoding))
    scan = nacre.load(path)
    assert scan.wavelengths.tolist() == [450.0, 650.0]
    assert scan.spectra.tolist() == [[0.1, 0.3]]
    assert scan.isotropic


def test_decimal_commas_and_spreadsheets_are_the_same_table(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    comma = nacre.load(write(tmp_path / "comma.csv", LONG.replace("0.", "0,")))
    book = openpyxl.Workbook()
    for row in ["a laboratory", *LONG.splitlines()]:
        cells = [float(c) if c.replace(".", "").isdigit() else c for c in row.split(";")]
        book.active.append(cells)
    book.active.title = "scan"
    book.save(tmp_path / "scan.xlsx")
    for options in ({}, {"sheet": "scan"}):
        sheet = nacre.load(tmp_path / "scan.xlsx", **options)
        np.testing.assert_allclose(sheet.spectra, comma.spectra)
    with pytest.raises(FormatError, match=r"there is no 'other' \(known: scan\)"):
        nacre.load(tmp_path / "scan.xlsx", sheet="other")
    data = (tmp_path / "scan.xlsx").read_bytes()
    for length in range(100, len(data), len(data) // 40):
        (tmp_path / "cut.xlsx").write_bytes(data[:length])
        with pytest.raises(FormatError):
            nacre.load(tmp_path / "cut.xlsx")


def in_plane(tmp_path: Path, f: str, sign: float = 1.0, name: str = "brdf") -> Path:
    rows = [f"inc,view,{name}"]
    for light in (10, 30, 50):
        for view in range(-60, 61, 10):
            level = 0.1 + 2.0 * (sign * view == light)
            rows.append(f"{light},{view},{eval(f, {'f': level, 'view': view, 'math': math}):.9g}")
    return write(tmp_path / "plane.csv", "\n".join(rows))


@pytest.mark.parametrize(
    ("formula", "name", "quantity"),
    [
        ("f", "brdf", None),
        ("math.pi * f", "BRF", None),
        ("100 * math.pi * f", "reflectance [%]", None),
        ("math.pi * f", "value", "brf"),
        ("f * math.cos(math.radians(view))", "value", "brdf-cos"),
        ("100 * math.pi * f", "value", "percent"),
    ],
)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_quantities_and_the_sense_of_signed_angles(
    tmp_path: Path, formula: str, name: str, quantity: str | None, sign: float
) -> None:
    scan = nacre.load(in_plane(tmp_path, formula, sign, name), quantity=quantity)
    t = math.radians(30.0)
    light, mirror = [-math.sin(t), 0.0, math.cos(t)], [math.sin(t), 0.0, math.cos(t)]
    assert scan.eval(light, mirror)[0] == pytest.approx(2.1, rel=1e-5)
    assert scan.eval(light, light)[0] == pytest.approx(0.1, rel=1e-4)
    side = "positive angles" if sign > 0.0 else "negative angles"
    assert side in scan.notes[0]


def test_what_numbers_say_and_what_they_leave_open(tmp_path: Path) -> None:
    white = write(tmp_path / "white.csv", "inc,view,x\n" + "10,20,0.98\n10,30,0.99\n10,40,0.97\n")
    with pytest.raises(FormatError, match="none is known as f"):
        nacre.load(white)
    scan = nacre.load(white, columns={"f": "x"})
    assert "reflectance factors" in scan.notes[0]
    assert "reflect 3.08 times the light" in scan.notes[0]
    dark = write(tmp_path / "dark.csv", "inc,view,x\n10,20,0.1\n10,30,0.1\n10,40,0.1\n")
    with pytest.raises(FormatError, match=r"nothing says what the values .* --quantity brdf"):
        nacre.load(dark, columns={"f": "x"})
    beside = {"columns": {"f": "3"}, "quantity": "brf"}
    write(tmp_path / "dark.csv.columns.json", json.dumps(beside))
    assert nacre.load(dark).samples.rgb[0, 0] == pytest.approx(0.1 / math.pi)
    assert nacre.load(dark, quantity="brdf").samples.rgb[0, 0] == pytest.approx(0.1)
    write(tmp_path / "dark.csv.columns.json", "[1]")
    with pytest.raises(FormatError, match=r"dark.csv.columns.json: expected"):
        nacre.load(dark)


def test_radians_anisotropy_and_noise(tmp_path: Path) -> None:
    rows = "theta_inc,phi_inc,theta_det,phi_det,f,sigma,temperature\n"
    rows += "0.5,0.1,0.7,3.0,0.2,0.01,21\n0.5,1.1,0.7,4.0,0.3,0.02,21\n"
    scan = nacre.load(write(tmp_path / "a.txt", rows), quantity="brdf")
    assert not scan.isotropic
    assert scan.samples.sigma.tolist() == [0.01, 0.02]
    expected = [math.sin(0.5) * math.cos(0.1), math.sin(0.5) * math.sin(0.1), math.cos(0.5)]
    np.testing.assert_allclose(scan.samples.wi[0], expected)
    assert scan.describe()["columns not used"] == "temperature"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("hello\nworld\n", "is of no known format"),
        ("inc,view,brdf\n10,20,\n10,20,0.1\n10,30,0.1\n", "no line that names columns"),
        ("inc,view,brdf\n10,20,0.1\n10,20,one\n", "line 3: column brdf: 'one' is not a number"),
        ("inc,view,brdf\n10,20,0.1\n10,20,0.1\n10,20\n", "line 4: 2 cells, expected 3"),
        ("inc,view,brdf\n10,20,0.1\n10,20,1e39\n", "line 3: column brdf: 1e+39 is too large"),
        ("inc,view,brdf\n10,20,-1\n10,20,-1\n", "no sample is above the horizon and measured"),
        ("inc,view,brdf\n10,95,0.1\n10,120,0.1\n", "no sample is above the horizon"),
        ("inc,view,brdf\n10,195,0.1\n10,20,0.1\n", "polar angles: must lie from -180 to 180"),
        ("inc;view;brdf\n10;20;0,1\n10;20;0.1\n", "decimals with ',' and with '.', use one"),
        ("inc,angle,brdf\n10,20,0.1\n10,20,0.1\n", "theta_o (the angle of the viewer"),
        ("inc,view,wl,brdf\n1,2,450,.1\n1,2,650,.1\n1,30,450,.1\n", "1 of 2 pairs of directions"),
        ("inc,view,wl,brdf\n1,2,-450,.1\n1,2,650,.1\n", "wavelengths: must be positive"),
    ],
)  # fmt: skip
def test_bad_tables_are_refused(tmp_path: Path, text: str, words: str) -> None:
    path = write(tmp_path / "bad.csv", text)
    with pytest.raises(FormatError) as caught:
        nacre.load(path)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"theta_i": "nothing"}, "there is no column 'nothing'"),
        ({"theta": "inc"}, "'theta' is none of theta_i"),
        ({"f": "9"}, "there is no column '9'"),
    ],
)
def test_bad_columns_are_named(tmp_path: Path, columns: dict[str, str], words: str) -> None:
    path = write(tmp_path / "a.csv", "inc,view,brdf\n10,20,0.1\n10,30,0.1\n")
    with pytest.raises(FormatError, match=words):
        nacre.load(path, columns=columns)
