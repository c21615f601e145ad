"""Values of real files of optical tools and laboratories, read a second time by other code.

Each test takes numbers out of the text with as little as possible, and places them by geometry of
its own.
"""

from __future__ import annotations

import csv
import json
import math
import re
import struct
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.measured.scattered import ScatteredBrdf
from tests.data import require_data

pytestmark = pytest.mark.filterwarnings("error")


def real(name: str) -> Path:
    return require_data("field", *name.split("/"))


def polar(theta: float, phi: float) -> np.ndarray:
    """A direction from degrees."""
    t, p = math.radians(theta), math.radians(phi)
    return np.array([math.sin(t) * math.cos(p), math.sin(t) * math.sin(p), math.cos(t)])


def value(scan: ScatteredBrdf, wi: np.ndarray, wo: np.ndarray) -> float:
    """The stored sample at a pair of directions, up to a turn and a mirroring."""
    index = int(scan.nearest(wi[None], wo[None])[0])
    light, view = scan.samples.wi[index], scan.samples.wo[index]
    cosines = [wi[2] - light[2], wo[2] - view[2], wi @ wo - light @ view]
    assert np.abs(cosines).max() < 2e-4
    return float(scan.samples.rgb[index, 0])


# Zemax


def zemax(path: Path) -> tuple[dict[str, list[float]], list[float], list[list[list[float]]]]:
    """Lists of angles, totals, and tables of rows."""
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    lists: dict[str, list[float]] = {}
    totals: list[float] = []
    tables: list[list[list[float]]] = []
    for before, line in zip(["", *lines], lines, strict=False):
        words = line.split()
        if re.match(r"(SampleRotation|AngleOfIncidence|Scatter(Azimuth|Radial))\s", before):
            lists[before.split()[0]] = [float(word) for word in words]
        if words[:1] == ["TIS"]:
            totals.append(float(words[1]))
            tables.append([])
        elif tables and words and words[0] != "DataEnd":
            tables[-1].append([float(word) for word in words])
    return lists, totals, tables


def about_mirror(incidence: float, azimuth: float, radial: float) -> np.ndarray:
    """A view at a distance from the mirror direction of light from -x; azimuth 0 is toward z."""
    t, r, a = (math.radians(angle) for angle in (incidence, radial, azimuth))
    turned = np.array([-math.sin(r) * math.cos(a), -math.sin(r) * math.sin(a), math.cos(r)])
    turn = np.array([[math.cos(t), 0, math.sin(t)], [0, 1, 0], [-math.sin(t), 0, math.cos(t)]])
    return turn @ turned


ZEMAX = [
    "zemax/AnoBlackEC1onAlum.bsdf",
    "zemax/AnoBlackNiTEonINVAR.bsdf",
    "zemax/ValidationTest_of_BRDF_via_MagicBlack.bsdf",
    "zemax/test_13_planesymmetric_brdf_zemax.bsdf",
    "zemax/test_13_brdf_one_wavelength_BRDF_zemax_reference.bsdf",
]


@pytest.mark.parametrize("name", ZEMAX)
def test_zemax_tables(name: str) -> None:
    lists, totals, tables = zemax(real(name))
    stored, scaled = nacre.load(real(name), as_stored=True), nacre.load(real(name))
    checked, errors = 0, []
    for k, incidence in enumerate(lists["AngleOfIncidence"]):
        theta = math.radians(incidence)
        wi = np.array([-math.sin(theta), 0.0, math.cos(theta)])
        ratios = []
        for i in range(0, len(lists["ScatterAzimuth"]), 3):
            for j in range(1, len(lists["ScatterRadial"]), 3):
                wo = about_mirror(incidence, lists["ScatterAzimuth"][i], lists["ScatterRadial"][j])
                if wo[2] < 0.05 or tables[k][i][j] <= 0.0:
                    continue
                found = value(stored, wi, wo)
                # Tables that are not quite symmetric hold two values for a mirrored pair, and all
                # azimuths of light at the normal are one.
                if incidence > 0.0:
                    errors.append(abs(found / tables[k][i][j] - 1.0))
                ratios.append(value(scaled, wi, wo) / found)
                checked += 1
        assert np.ptp(ratios) < 1e-6 * max(ratios) + 0.02 * max(ratios)
        assert scaled.notes or abs(ratios[0] - 1.0) < 0.01
        assert _reflected(lists, tables[k], incidence) * ratios[0] == pytest.approx(
            totals[k], rel=0.03
        )
    assert checked > 40
    assert np.percentile(errors, 95) < 0.03
    assert np.max(errors) < 0.1


def _reflected(lists: dict[str, list[float]], table: list[list[float]], incidence: float) -> float:
    """The share of light that a table reflects, by a sum over even points of the hemisphere."""
    from scipy.interpolate import RegularGridInterpolator

    azimuths, radials = lists["ScatterAzimuth"], lists["ScatterRadial"]
    f = RegularGridInterpolator((azimuths, radials), table, bounds_error=False, fill_value=0.0)
    n = 250
    z, phi = np.meshgrid((np.arange(n) + 0.5) / n, (np.arange(2 * n) + 0.5) / n * math.pi)
    r = np.sqrt(1.0 - z * z)
    x, y = r * np.cos(phi), r * np.sin(phi)
    t = math.radians(incidence)
    along, out = x * math.sin(t) + z * math.cos(t), z * math.sin(t) - x * math.cos(t)
    azimuth = np.degrees(np.arctan2(-y, out)) % 360.0
    if azimuths[-1] <= 180.0:
        azimuth = np.where(azimuth > 180.0, 360.0 - azimuth, azimuth)
    radial = np.degrees(np.arccos(np.clip(along, -1.0, 1.0)))
    return float((f(np.stack([azimuth, radial], -1)) * z).mean() * 2.0 * math.pi)


def test_zemax_rotations_make_an_anisotropic_scan() -> None:
    path = real("zemax/IMX455.bsdf")
    lists, _, tables = zemax(path)
    scan = nacre.load(path, as_stored=True)
    assert not scan.isotropic
    assert scan.channels == ("650 nm",) * 3
    incidences = lists["AngleOfIncidence"]
    for r in (1, 5, 17, 30):  # the first and the last are one, and averaged
        for k, incidence in enumerate(incidences):
            table = tables[r * len(incidences) + k]
            turn = math.radians(90.0 - lists["SampleRotation"][r])
            matrix = np.array(
                [
                    [math.cos(turn), -math.sin(turn), 0],
                    [math.sin(turn), math.cos(turn), 0],
                    [0, 0, 1],
                ]
            )
            wi = matrix @ polar(incidence, 180.0)
            for i, j in ((3, 2), (10, 4), (20, 1), (33, 6)):
                wo = matrix @ about_mirror(
                    incidence, lists["ScatterAzimuth"][i], lists["ScatterRadial"][j]
                )
                if wo[2] < 0.05:
                    continue
                index = int(scan.nearest(wi[None], wo[None])[0])
                assert np.abs(scan.samples.wi[index] - wi).max() < 1e-6
                assert np.abs(scan.samples.wo[index] - wo).max() < 1e-6
                assert scan.samples.rgb[index, 0] == pytest.approx(table[i][j], rel=1e-6)


def test_transmission_is_refused() -> None:
    with pytest.raises(nacre.FormatError, match=r"btdf.*only reflection"):
        nacre.load(real("zemax/test_13_planesymmetric_btdf_zemax.bsdf"))


def test_one_measurement_in_two_formats_is_one_material() -> None:
    """Within 5 % at nearly all views of each incidence."""
    a = nacre.load(real("speos/test_13_brdf_one_wavelength_speos.brdf"))
    b = nacre.load(real("zemax/test_13_brdf_one_wavelength_BRDF_zemax_reference.bsdf"))
    assert any("transmission" in note for note in a.notes)
    assert any("1.58 to 46.8" in note for note in b.notes)
    rng = np.random.default_rng(0)
    for theta in (0.0, 22.5, 45.0, 67.5):
        z = np.sqrt(rng.uniform(size=400))
        phi = rng.uniform(0.0, 2.0 * math.pi, 400)
        r = np.sqrt(1.0 - z * z)
        wo = np.stack([r * np.cos(phi), r * np.sin(phi), z], -1)
        wi = polar(theta, 180.0)
        ratio = a.eval(wi, wo)[:, 0] / b.eval(wi, wo)[:, 0]
        assert np.percentile(np.abs(ratio - 1.0), 95) < 0.05


# Speos


def test_a_spectral_speos_table() -> None:
    path = real("speos/test_13_brdf_one_wavelength_speos.brdf")
    lines = path.read_text().splitlines()
    start = next(i for i, line in enumerate(lines) if line.strip() == "91\t361")
    percent = float(lines[start - 1])
    rows = np.array([[float(w) for w in line.split()] for line in lines[start + 2 : start + 93]])
    theta, table = np.radians(rows[:, 0]), rows[:, 1:]
    weight = np.sin(theta) * np.cos(theta)
    total = np.trapezoid(np.trapezoid(table, dx=math.radians(1.0), axis=1) * weight, theta)
    scan = nacre.load(path)
    for i, j in ((10, 0), (40, 90), (70, 200)):
        # Azimuths of light at the normal are one.
        expected = table[i].mean() * 0.01 * percent / total
        found = value(scan, polar(0.0, 180.0), polar(rows[i, 0], float(j)))
        assert found == pytest.approx(expected, rel=0.02)


def blocks(path: Path) -> Iterator[tuple[list[float], list[list[float]]]]:
    """Azimuths, and rows that begin with a polar angle, of each table of an anisotropic file."""
    lines = path.read_text().splitlines()
    for i, line in enumerate(lines):
        shape = re.fullmatch(r"(\d+) (\d+)", line.strip())
        if shape and lines[i + 1].startswith("\t"):
            azimuths = [float(word) for word in lines[i + 1].split()]
            rows = lines[i + 2 : i + 2 + int(shape[1])]
            yield azimuths, [[float(word) for word in row.split()] for row in rows]


def test_anisotropic_speos_text() -> None:
    path = real("speos/aniso_bsdf.anisotropicbsdf")
    scan = nacre.load(path, as_stored=True)
    assert not scan.isotropic
    incidences = [5.0 * k for k in range(1, 18)] + [88.0, 89.0]
    for k, (azimuths, rows) in enumerate(blocks(path)):
        rotation, incidence = (0.0, 90.0, 180.0)[k // 19], incidences[k % 19]
        for i, j in ((2, 3), (9, 20), (15, 33)):
            wi = polar(incidence, 180.0 - rotation)
            wo = polar(rows[i][0], azimuths[j] - rotation)
            index = int(scan.nearest(wi[None], wo[None])[0])
            assert np.abs(scan.samples.wo[index] - wo).max() < 2e-3
            # The file stores intensities.
            expected = rows[i][1 + j] / math.cos(math.radians(rows[i][0]))
            assert scan.samples.rgb[index, 0] == pytest.approx(expected, rel=1e-6)


def test_binary_speos_is_the_text_of_its_values() -> None:
    """Doubles of a table can be found in the file where LZ4 copies them as they are."""
    path = real("speos/R_test.anisotropicbsdf")
    data = path.read_bytes()
    scan = nacre.load(path, as_stored=True)
    assert scan.isotropic
    for stored in (0.278518, 0.244735, 0.244602):
        assert struct.pack("<d", stored) in data
    found = value(scan, polar(5.0, 180.0), polar(5.0, 50.0))
    assert found == pytest.approx(0.244602 / math.cos(math.radians(5.0)), rel=0.01)
    # 62.27 % of the light at 6 degrees, as its header says
    albedo = nacre.load(path).albedo(polar(6.0, 0.0))[0]
    assert albedo == pytest.approx(0.6227, rel=0.02)


def test_a_converted_speos_file_is_near_its_zemax_original() -> None:
    a = nacre.load(real("speos/test_13_planesymmetric_brdf_speos_reference.anisotropicbsdf"))
    b = nacre.load(real("zemax/test_13_planesymmetric_brdf_zemax.bsdf"))
    for theta in (15.0, 30.0, 45.0, 60.0):
        views = [polar(t, p) for t in (5, 20, 35, 50) for p in (0, 40, 90, 170)]
        ratio = [
            a.eval(polar(theta, 180.0), w)[0] / b.eval(polar(theta, 180.0), w)[0] for w in views
        ]
        assert np.median(ratio) == pytest.approx(1.0, rel=0.02)


# FRED


@pytest.mark.parametrize("name", ["AnoBlackEC1onAlum.txt", "AnoBlackEC1onAlum_fullAz.txt"])
def test_fred_tables(name: str) -> None:
    path = real(f"fred/{name}")
    scan = nacre.load(path)
    light, checked = 0.0, 0
    for number, line in enumerate(path.read_text().splitlines()):
        words = line.split()
        if len(words) == 2 and words[0] != "type":
            light = float(words[0])
        elif len(words) == 3 and number % 17 == 0:
            theta, phi, f = map(float, words)
            if theta < 85.0:
                found = value(scan, polar(light, 180.0), polar(theta, phi))
                assert found == pytest.approx(f, rel=1e-4)
                checked += 1
    assert checked > 50


def test_fred_and_zemax_hold_one_measurement() -> None:
    fred = nacre.load(real("fred/AnoBlackEC1onAlum.txt"))
    zemax_ = nacre.load(real("zemax/AnoBlackEC1onAlum.bsdf"), as_stored=True)
    views = [polar(t, p) for t in range(5, 70, 5) for p in range(0, 181, 20)]
    for theta in (10.0, 30.0, 50.0, 70.0):
        wi = polar(theta, 180.0)
        ratio = [fred.eval(wi, wo)[0] / zemax_.eval(wi, wo)[0] for wo in views]
        assert np.median(ratio) == pytest.approx(1.0, rel=0.03)


# Tables of goniometers


def test_reflectance_factors_of_nine_bands() -> None:
    path = real("goniometer/20250409_S7_swir_sample.txt")
    scan = nacre.load(path)
    lines = path.read_text().splitlines()
    names = next(line for line in lines if line.startswith("src_z")).split()
    assert scan.wavelengths.tolist() == [float(name[:-2]) for name in names[4:]]
    rows = [[float(w) for w in line.split()] for line in lines[lines.index("\t".join(names)) + 1 :]]
    for row in rows[1:-1]:
        found = scan.eval_spectral(polar(row[0], row[1]), polar(row[2], row[3]))
        np.testing.assert_allclose(found, np.array(row[4:]) / math.pi, rtol=2e-3)
    assert scan.channels == ("2402.92 nm", "2164.17 nm", "1243.53 nm")


def test_a_scan_in_the_plane_of_incidence() -> None:
    path = real("goniometer/test_brdf_viewer_2D_data.csv")
    scan = nacre.load(path)
    with path.open(newline="") as file:
        rows = list(csv.reader(file))
    for row in rows[1:-1:23]:
        light, view, *values = map(float, row)
        wo = polar(abs(view), 0.0 if view > 0.0 else 180.0)
        found = scan.eval_spectral(polar(light, 180.0), wo)
        np.testing.assert_allclose(found, np.array(values) / math.pi, rtol=1e-3, atol=1e-8)
    assert "reflectance factors" in " ".join(scan.notes)


# BiRD, OpenMATERIAL


def test_a_universal_brdf_file() -> None:
    path = real("bird/example.brdf")
    scan = nacre.load(path)
    data = json.loads(path.read_text())["data"]
    f = np.array(data["BRDF"]["values"]).reshape(4, 2).mean(axis=1)
    assert scan.wavelengths.tolist() == sorted(set(data["wavelength_i"]["values"]))
    np.testing.assert_allclose(scan.eval_spectral(polar(0, 0), polar(10, 60)), f, rtol=1e-5)


def test_a_material_and_its_table() -> None:
    material = nacre.load(real("openmaterial/example_material.xomp"))
    table = nacre.load(real("openmaterial/example_material_camera_brdf.xompt"))
    assert material.replaced(notes=table.notes) == table.replaced(source=material.source)
    rows = json.loads(real("openmaterial/example_material_camera_brdf.xompt").read_text())
    rows = rows["brdf"]["lookupTable"]
    assert table.wavelengths.tolist() == pytest.approx(sorted({1e9 * row[0] for row in rows}))
    for row in rows[:: len(rows) // 12]:
        wi, wo = (polar(math.degrees(a), math.degrees(b)) for a, b in ((row[1], 0), row[2:4]))
        band = int(np.abs(table.wavelengths - 1e9 * row[0]).argmin())
        assert table.eval_spectral(wi, wo)[band] == pytest.approx(row[4], rel=5e-3)
