"""The Cornell reader: real scans, colors against colour-science, damaged files."""

from __future__ import annotations

import functools
import math
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.errors import FormatError
from nacre.formats import identify
from nacre.geometry import from_spherical, join, split, to_spherical
from nacre.measured import cornell
from nacre.spectra import to_rgb
from tests.data import list_data, require_data
from tests.measured import support
from tests.measured.support import hemisphere, write

BANDS = (450.0, 550.0, 650.0)
ANGLES = ((0.3, 0.0, 0.5, -2.0), (1.0, 0.0, 1.2, 3.141593), (0.3, 0.0, 1.2, 0.7))


def scan_bytes(
    rows: tuple[tuple[float, ...], ...] = ANGLES, values: tuple[float, ...] = (0.1, 0.2, 0.3)
) -> bytes:
    lines = ["# Cornell University, Program of Computer Graphics", "# Test Paint", "# Matte", ""]
    lines += ["# num wls", str(len(BANDS)), "", "# wls", " ".join(map(str, BANDS)), ""]
    lines += [" ".join(f"{x:.6f}" for x in (*row, *values)) for row in rows]
    return ("\r\n".join(lines) + "\r\n").encode()


def test_a_scan_is_read_as_it_stands(tmp_path: Path) -> None:
    path = write(tmp_path / "paint.brdf", scan_bytes())
    brdf = nacre.load(path)
    assert brdf.name == "Test Paint"
    assert brdf.describe()["remarks"] == "Matte"
    rows = np.array(ANGLES)
    np.testing.assert_allclose(brdf.samples.wi, join(from_spherical(rows[:, 0], rows[:, 1])))
    np.testing.assert_allclose(brdf.samples.wo, join(from_spherical(rows[:, 2], rows[:, 3])))
    np.testing.assert_array_equal(brdf.wavelengths, BANDS)
    np.testing.assert_array_equal(brdf.spectra, np.tile([0.1, 0.2, 0.3], (3, 1)))
    np.testing.assert_array_equal(brdf.samples.rgb, to_rgb(brdf.spectra, BANDS))


@pytest.mark.parametrize("name", list_data("cornell", "*.brdf") or ["garnet_red.brdf"])
def test_real_scans(name: str) -> None:
    brdf = nacre.load(require_data("cornell", name))
    assert isinstance(brdf, nacre.measured.ScatteredBrdf)
    assert len(brdf.samples) == 1439
    assert brdf.spectra.shape == (1439, 31)
    assert brdf.wavelengths[[0, -1]].tolist() == [400.0, 700.0]
    facts = brdf.describe()
    assert facts["dropped below the horizon"] == facts["averaged as duplicates"] == 0
    # The light stands at eight angles of one azimuth: that it may stand at any other is assumed.
    theta_i, phi_i = to_spherical(split(brdf.samples.wi))
    assert np.unique(np.degrees(theta_i).round(2)).tolist() == [10, 20, 30, 40, 50, 60, 70, 80]
    assert np.abs(phi_i).max() < 1e-6
    through = brdf.eval_spectral(brdf.samples.wi, brdf.samples.wo)
    np.testing.assert_allclose(through, brdf.spectra, rtol=1e-2, atol=1e-4 * brdf.spectra.max())
    # The highlight is opposite the light.
    brightest = brdf.samples.rgb.sum(axis=1).argmax()
    wi, wo = brdf.samples.wi[brightest], brdf.samples.wo[brightest]
    assert np.linalg.norm(wi * [-1, -1, 1] - wo) < 0.05
    rng = np.random.default_rng(0)
    assert np.isfinite(brdf.eval(hemisphere(rng, 1000), hemisphere(rng, 1000))).all()


def test_names_and_colors_of_the_real_scans() -> None:
    facing = {}
    for name in ("garnet_red", "krylon_blue"):
        brdf = nacre.load(require_data("cornell", f"{name}.brdf"))
        facing[brdf.name.split(",")[0]] = brdf.eval([0.36, 0.48, 0.8], [0.0, -0.6, 0.8])
    red, green, blue = facing["Garnet Red"]
    assert red > 2 * green
    assert red > 2 * blue
    red, green, blue = facing["Krylon spray enamel 7205"]
    assert blue > 2 * red


def test_colors_are_those_of_colour_science() -> None:
    colour = pytest.importorskip("colour", reason="colour-science computes them too")

    nodes = np.arange(360.0, 781.0)
    shape = colour.SpectralShape(360, 780, 1)
    random = np.random.default_rng(1)
    bands = np.arange(400.0, 701.0, 10.0)
    spectra = random.random((4, len(bands)))
    fine = np.stack([np.interp(nodes, bands, s) for s in spectra])
    xyz = colour.msds_to_XYZ(
        fine,
        method="Integration",
        shape=shape,
        cmfs=colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape),
        illuminant=colour.SDS_ILLUMINANTS["D65"].copy().interpolate(shape),
    )
    expected = xyz / 100 @ colour.RGB_COLOURSPACES["ITU-R BT.709"].matrix_XYZ_to_RGB.T
    np.testing.assert_allclose(to_rgb(spectra, bands), expected, atol=3e-4)
    np.testing.assert_allclose(to_rgb([0.7], [555.0]), 0.7, rtol=1e-3)
    with pytest.raises(ValueError, match="increasing"):
        to_rgb([0.7, 0.7], [555.0, 500.0])


# Damaged files


assert_refused = functools.partial(support.assert_refused, cornell.load)


def test_a_file_cut_anywhere_is_refused_or_whole_lines_shorter(tmp_path: Path) -> None:
    data = scan_bytes()
    path = tmp_path / "cut.brdf"
    readable = []
    for length in range(1, len(data)):
        write(path, data[:length])
        try:
            readable.append((length, len(cornell.load(path).samples)))
        except FormatError:
            assert_refused(path)
    ends = [k + 1 for k, byte in enumerate(data[:-1]) if byte in b"\r\n"]
    whole = data.count(b"\r\n")
    assert [length for length, _ in readable] == ends[-len(readable) :]
    assert whole
    assert {count for _, count in readable} == {1, 2, 3}


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"# Cornell\n", "no numbers"),
        (b"# Cornell\n0\n", "number of bands"),
        (b"# Cornell\n2.5\n", "number of bands"),
        (b"# Cornell\n1e30\n", "number of bands"),
        (b"# Cornell\n3\n400 500\n", "wavelengths: 2 of 3"),
        (b"# Cornell\n2\n500 400\n0 0 0 0 1 1\n", "must be positive and increase"),
        (b"# Cornell\n1\n500\n0 0 0 0\n", "expected a multiple of 5"),
        (b"# Cornell\n1\n500\n50 0 0 0 1\n", "polar angles: must be radians"),
        (b"# Cornell\n1\n500\n1 180 0 0 1\n", "azimuths: must be radians"),
        (b"# Cornell\n1\n500\n0 0 3 0 1\n", "no sample is above the horizon"),
        (b"# Cornell\n1\n500\n0 0 0 0 nan\n", "'nan' is no number"),
        (b"# Cornell\n1\n500\n0 0 0 0 1e300\n", "not finite"),
        (b"# Cornell\n1\n500\n0 0 0 0 one\n", "'one' is no number"),
        (b"# Cornell\n1\n500\n0 0 0 0 1", "cut short"),
        ("# Cornell é\n1\n".encode(), "wavelengths: 0 of 1"),
        (b"", "is empty"),
    ],
)
def test_what_is_not_a_scan_is_refused(tmp_path: Path, data: bytes, words: str) -> None:
    assert_refused(write(tmp_path / "bad.brdf", data), words)


def test_a_long_token_makes_a_short_message(tmp_path: Path) -> None:
    with pytest.raises(FormatError) as caught:
        cornell.load(write(tmp_path / "bad.brdf", b"# Cornell\n1\n" + b"x" * 10_000 + b"\n"))
    assert len(str(caught.value)) < 300 + len(str(tmp_path))


def test_a_scan_is_written_as_a_table_of_the_same_ending(tmp_path: Path) -> None:
    brdf = cornell.load(write(tmp_path / "a.brdf", scan_bytes()))
    nacre.save(brdf, tmp_path / "b.brdf")
    assert identify(tmp_path / "a.brdf").name == "Cornell scan"
    assert identify(tmp_path / "b.brdf").name == "Speos BSDF"


def test_angles_below_the_horizon_are_counted(tmp_path: Path) -> None:
    rows = (*ANGLES, (0.3, 0.0, math.pi / 2, 0.0), (2.0, 0.0, 0.1, 0.0), ANGLES[0])
    facts = cornell.load(write(tmp_path / "a.brdf", scan_bytes(rows))).describe()
    assert facts["samples"] == 3
    assert facts["dropped below the horizon"] == 2
    assert facts["averaged as duplicates"] == 1
