"""Comma-separated samples: the grammar, a round trip, and files that break it."""

from __future__ import annotations

import contextlib
import functools
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.color import xyz_to_rgb
from nacre.errors import FormatError
from nacre.geometry import from_spherical, join
from nacre.measured import ScatteredBrdf, comma_separated
from tests.data import require_data
from tests.measured import support
from tests.measured.support import hemisphere, write

PLAIN = """# name: red paint
# units: degrees
# measured by: hand
theta_i,phi_i,theta_o,phi_o,r,g,b
30,0,40,180,0.5,0.2,0.1
60,10,20,-90,0.4,0.1,-0.01
"""


def read(tmp_path: Path, text: str) -> ScatteredBrdf:
    brdf = nacre.load(write(tmp_path / "a.csv", text.encode()))
    assert isinstance(brdf, ScatteredBrdf)
    return brdf


def test_columns_mean_what_they_say(tmp_path: Path) -> None:
    brdf = read(tmp_path, PLAIN)
    assert brdf.name == "red paint"
    assert brdf.isotropic
    assert brdf.describe()["header measured by"] == "hand"
    theta, phi = np.radians([[30, 60], [0, 10]])
    np.testing.assert_allclose(brdf.samples.wi, join(from_spherical(theta, phi)))
    theta, phi = np.radians([[40, 20], [180, -90]])
    np.testing.assert_allclose(brdf.samples.wo, join(from_spherical(theta, phi)))
    np.testing.assert_array_equal(brdf.samples.rgb, [[0.5, 0.2, 0.1], [0.4, 0.1, -0.01]])


@pytest.mark.parametrize(
    "text",
    [
        PLAIN.replace("\n", "\r\n"),
        "\ufeff" + PLAIN,
        PLAIN.replace("# ", "").replace("name", "ASTM E1392\nname"),
        PLAIN.replace(": ", " = "),
        PLAIN.replace("# units: degrees\n", "").replace("theta_i,phi_i", "theta_i [deg],phi_i(deg)")
        .replace("theta_o,phi_o", "Theta_s [degrees], phi_s [deg]"),
        PLAIN.replace("r,g,b", "Red,Green,Blue").replace(",", " , "),
        PLAIN.replace("r,g,b\n", "r,g,b\n# a remark\n\n,,,,,,\n"),
        PLAIN.replace("r,g,b", "b,g,r").replace("0.5,0.2,0.1", "0.1,0.2,0.5")
        .replace("0.4,0.1,-0.01", "-0.01,0.1,0.4"),
        "".join(f"{line},,\n" if ":" in line else f"{line}\n" for line in PLAIN.splitlines()),
        PLAIN.replace("# name", "# isotropic: yes\n# name").rstrip("\n"),
    ],
)  # fmt: skip
def test_other_ways_to_write_the_same(tmp_path: Path, text: str) -> None:
    expected, got = read(tmp_path, PLAIN), read(tmp_path, text)
    assert got.name == "red paint"
    for name in ("wi", "wo", "rgb"):
        np.testing.assert_array_equal(getattr(got.samples, name), getattr(expected.samples, name))


def test_radians_grey_values_and_anisotropy(tmp_path: Path) -> None:
    text = "theta_i [rad],phi_i [rad],theta_o [rad],phi_o [rad],f\n0.5,0,0.7,3.1,0.25\n"
    brdf = read(tmp_path, "# isotropic: no\n" + text)
    assert not brdf.isotropic
    assert brdf.name == "a"
    np.testing.assert_array_equal(brdf.samples.rgb, [[0.25, 0.25, 0.25]])
    np.testing.assert_allclose(brdf.samples.wi[0], [np.sin(0.5), 0.0, np.cos(0.5)])


def test_bands_become_colors(tmp_path: Path) -> None:
    text = PLAIN.replace("r,g,b", "650 nm,450nm,550").replace("-0.01", "0.3")
    brdf = read(tmp_path, text)
    assert brdf.wavelengths.tolist() == [450.0, 550.0, 650.0]
    np.testing.assert_array_equal(brdf.spectra, [[0.2, 0.1, 0.5], [0.1, 0.3, 0.4]])
    assert brdf.samples.rgb[0, 0] > brdf.samples.rgb[0, 1]


def test_tristimulus_values_become_colors(tmp_path: Path) -> None:
    colour = pytest.importorskip("colour", reason="colour-science has the matrix")
    brdf = read(tmp_path, PLAIN.replace("r,g,b", "X,Y,Z"))
    matrix = colour.RGB_COLOURSPACES["ITU-R BT.709"].matrix_XYZ_to_RGB
    expected = np.array([[0.5, 0.2, 0.1], [0.4, 0.1, -0.01]]) @ matrix.T
    np.testing.assert_allclose(brdf.samples.rgb, expected, atol=1e-4)
    white = colour.xy_to_XYZ([0.3127, 0.3290])
    np.testing.assert_allclose(xyz_to_rgb(white), 1.0, rtol=1e-12)


@pytest.mark.parametrize("separator", [";", "\t", " ", " ; "])
@pytest.mark.parametrize("decimal", [".", ","])
def test_other_separators(tmp_path: Path, separator: str, decimal: str) -> None:
    text = PLAIN.replace("# name", "# note: a, b; c.d\n# name").replace(".", decimal)
    head, names, rows = text.partition("theta_i,phi_i,theta_o,phi_o,r,g,b\n")
    names = names.strip().replace(",", separator) + "\n"
    rows = "30,0,40,180,0.5,0.2,0.1\n60,10,20,-90,0.4,0.1,-0.01\n".replace(",", separator)
    got = read(tmp_path, head + names + rows.replace(".", decimal))
    expected = read(tmp_path, PLAIN).samples
    for name in ("wi", "wo", "rgb"):
        np.testing.assert_array_equal(getattr(got.samples, name), getattr(expected, name))


def test_thousands_are_not_taken_for_decimals(tmp_path: Path) -> None:
    text = "theta_i [deg];phi_i [deg];theta_o [deg];phi_o [deg];f\n0;0;0;0;1,234\n0;0;10;0;0.5\n"
    assert_refused(write(tmp_path / "a.csv", text.encode()), "line 3", "decimals with ','")


ASTM = """ASTM E1392-96
DATE Tue Jan 1 2002
SAMPLE_NAME red paint
wavelength: as measured
free text without a key
NUM_POINTS 2
VARS theta_i,phi_i,theta_s,phi_s,R,G,B
0.5,0.0,0.7,3.1,0.5,0.2,0.1
1.0,0.0,0.3,1.5,0.4,0.1,-0.01
"""


@pytest.mark.parametrize("text", [ASTM, ASTM.replace("VARS ", "VARS="), ASTM[14:]])
def test_astm_files_have_radians_and_a_count(tmp_path: Path, text: str) -> None:
    brdf = nacre.load(write(tmp_path / "paint.astm", text.encode()))
    assert isinstance(brdf, ScatteredBrdf)
    theta, phi = np.array([[0.7, 0.3], [3.1, 1.5]])
    np.testing.assert_allclose(brdf.samples.wo, join(from_spherical(theta, phi)))
    np.testing.assert_array_equal(brdf.samples.rgb, [[0.5, 0.2, 0.1], [0.4, 0.1, -0.01]])
    facts = brdf.describe()
    assert facts["header sample_name"] == "red paint"
    assert facts["header wavelength"] == "as measured"
    cut = text[: text.rindex("1.0,")]
    assert_refused(write(tmp_path / "cut.astm", cut.encode()), "'num_points' says 2")
    degrees = text.replace("0.7,", "40,")
    assert_refused(write(tmp_path / "deg.astm", degrees.encode()), "check the units")


def test_astm_bands(tmp_path: Path) -> None:
    text = ASTM.replace("R,G,B", "450nm,550nm,650nm").replace("-0.01", "0.3")
    brdf = nacre.load(write(tmp_path / "paint.astm", text.encode()))
    assert brdf.wavelengths.tolist() == [450.0, 550.0, 650.0]


def test_duplicates_and_directions_below_the_horizon_are_counted(tmp_path: Path) -> None:
    facts = read(
        tmp_path, PLAIN + "30,0,40,180,0.7,0.2,0.1\n95,0,0,0,1,1,1\n0,0,90,0,1,1,1\n"
    ).describe()
    assert facts["samples"] == 2
    assert facts["averaged as duplicates"] == 1
    assert facts["dropped below the horizon"] == 2
    assert facts["value range"] == [-0.01, 0.6]


# Writing


@pytest.mark.parametrize("isotropic", [True, False])
def test_samples_come_back_and_are_written_the_same_again(tmp_path: Path, isotropic: bool) -> None:
    rng = np.random.default_rng(0)
    wi, wo = hemisphere(rng, 200), hemisphere(rng, 200)
    wi[0] = wo[0] = wi[1] = (0.0, 0.0, 1.0)
    brdf = ScatteredBrdf(wi, wo, rng.random((200, 3)) - 0.01, "a, b: c", isotropic=isotropic)
    nacre.save(brdf, tmp_path / "one.csv")
    back = nacre.load(tmp_path / "one.csv")
    assert back.name == "a, b: c"
    assert back.isotropic == isotropic
    np.testing.assert_allclose(back.samples.wi, brdf.samples.wi, atol=2e-9)
    np.testing.assert_allclose(back.samples.wo, brdf.samples.wo, atol=2e-9)
    np.testing.assert_allclose(back.samples.rgb, brdf.samples.rgb, rtol=1e-8)
    nacre.save(back, tmp_path / "two.csv")
    assert (tmp_path / "one.csv").read_bytes() == (tmp_path / "two.csv").read_bytes()


def test_a_real_scan_comes_back_with_its_spectra(tmp_path: Path) -> None:
    brdf = nacre.load(require_data("cornell", "garnet_red.brdf"))
    nacre.save(brdf, tmp_path / "one.csv")
    back = nacre.load(tmp_path / "one.csv")
    np.testing.assert_allclose(back.spectra, brdf.spectra, rtol=1e-8)
    np.testing.assert_array_equal(back.wavelengths, brdf.wavelengths)
    np.testing.assert_allclose(back.samples.rgb, brdf.samples.rgb, rtol=1e-6, atol=1e-9)
    nacre.save(back, tmp_path / "two.csv")
    assert (tmp_path / "one.csv").read_bytes() == (tmp_path / "two.csv").read_bytes()


# Damaged files


assert_refused = functools.partial(support.assert_refused, comma_separated.load)


def test_a_file_cut_anywhere_is_refused_or_shorter(tmp_path: Path) -> None:
    data = PLAIN.encode()
    path = tmp_path / "cut.csv"
    for length in range(1, len(data)):
        write(path, data[:length])
        try:
            assert len(comma_separated.load(path).samples) <= 2
        except FormatError:
            assert_refused(path)
    first_value = data.index(b"0.5,")
    assert_refused(write(path, data[:first_value]), "line 5: 5 values, expected 7")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("theta_i", "theta", "no line that names columns"),
        ("theta_o,", "", "theta_o missing"),
        ("phi_o", "phi_i", "phi_o missing"),
        ("r,g,b", "r,g,g", "'g' appears twice"),
        ("r,g,b", "r,g,x", "or wavelengths in nm; found r, g, x"),
        ("r,g,b", "500,600,600.0", "wavelengths must differ"),
        ("r,g,b", "500,600,9223372036854775808", "be 1 to 1,000,000 nm"),
        ("r,g,b", "500,600,0.00001", "be 1 to 1,000,000 nm"),
        ("# units: degrees\n", "", "theta_i: has no unit"),
        ("degrees", "gradians", "unit 'gradians', expected degrees or radians"),
        ("degrees", "radians", "polar angles"),
        ("0.2", "two", "line 5: column g: 'two' is not a finite number"),
        ("0.2", "nan", "not a finite number"),
        ("0.2", "1e39", "not a finite number"),
        ("0.2", "", "not a finite number"),
        ("0.2", "1_0", "'1_0' is not a finite number"),
        ("# name", "# samples: 3\n# name", "holds 2 samples, but header 'samples' says 3"),
        ("# name", "NUM_POINTS 1\n# name", "holds 2 samples, but header 'num_points' says 1"),
        ("# name", "# samples: few\n# name", "expected a whole number"),
        ("r,g,b", "x,y,b", "or wavelengths in nm; found x, y, b"),
        ("0.5,0.2,0.1", "0.5,0.2", "line 5: 6 values, expected 7"),
        ("# name", "# isotropic: perhaps\n# name", "header 'isotropic'"),
        ("paint\n", "paint\n1,2,3\n", "line 2: is neither"),
    ],
)
def test_broken_files_are_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in PLAIN
    assert_refused(write(tmp_path / "a.csv", PLAIN.replace(old, new, 1).encode()), words)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "is empty"),
        (b"# units: degrees\n", "no line that names columns"),
        (b"VARS\n", "theta_i, phi_i, theta_o, phi_o missing"),
        (PLAIN.partition("\n30")[0].encode(), "holds no samples"),
        (PLAIN.replace("30,", "120,").replace("60,", "120,").encode(), "no sample is above"),
    ],
)
def test_what_is_not_a_table_is_refused(tmp_path: Path, data: bytes, words: str) -> None:
    assert_refused(write(tmp_path / "a.csv", data), words)


def test_a_file_that_we_wrote_is_refused_when_cut_at_a_line(tmp_path: Path) -> None:
    nacre.save(read(tmp_path, PLAIN), tmp_path / "whole.csv")
    lines = (tmp_path / "whole.csv").read_bytes().splitlines(keepends=True)
    assert len(comma_separated.load(tmp_path / "whole.csv").samples) == 2
    assert_refused(write(tmp_path / "cut.csv", b"".join(lines[:-1])), "holds 1 samples", "says 2")


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "latin-1"])
def test_text_of_any_usual_encoding_is_the_same_table(tmp_path: Path, encoding: str) -> None:
    data = PLAIN.replace("red", "r\xf6t").encode(encoding)
    plain = nacre.load(write(tmp_path / "b.csv", PLAIN.replace("red", "r\xf6t").encode()))
    found = nacre.load(write(tmp_path / "a.csv", data))
    assert found.name == plain.name == "r\xf6t paint"
    np.testing.assert_array_equal(found.samples.rgb, plain.samples.rgb)


LONG = 400_000


@pytest.mark.parametrize(
    "text",
    [
        "# " + "x" * LONG,
        "# name: " + " " * LONG + "x",
        "# " + " " * LONG,
        "theta_i [" + " " * LONG,
        "theta_i," + "," * LONG,
        PLAIN + "1," * LONG,
        PLAIN + "\n" * LONG,
        "\n" * LONG,
        "# a: b\n" * (LONG // 7),
        PLAIN + "# \n" * (LONG // 3),
    ],
)
def test_long_files_take_memory_and_time_in_proportion(tmp_path: Path, text: str) -> None:
    path = write(tmp_path / "long.csv", text.encode())
    tracemalloc.start()
    try:
        with contextlib.suppress(FormatError):
            comma_separated.load(path)
        assert tracemalloc.get_traced_memory()[1] < 8 * LONG + 500_000
    finally:
        tracemalloc.stop()


def test_a_name_that_is_not_unicode_is_written_with_marks(tmp_path):
    up = np.array([[0.0, 0.0, 1.0]])
    brdf = ScatteredBrdf(up, up, up, "a\udcff")  # as Python has the byte 255 in a file's name
    comma_separated.save(brdf, tmp_path / "x.csv")
    assert nacre.load(tmp_path / "x.csv").name == "a?"


def test_noise_is_read_and_written(tmp_path: Path) -> None:
    text = PLAIN.replace("r,g,b", "r,g,b,sigma").replace("0.1\n", "0.1,0.02\n", 1)
    brdf = read(tmp_path, text.replace("-0.01\n", "-0.01,0.01\n"))
    assert brdf.samples.sigma is not None
    np.testing.assert_array_equal(brdf.samples.sigma, [0.02, 0.01])
    np.testing.assert_array_equal(brdf.subset(np.array([1])).samples.sigma, [0.01])
    comma_separated.save(brdf, tmp_path / "b.csv")
    again = comma_separated.load(tmp_path / "b.csv")
    np.testing.assert_array_equal(again.samples.sigma, brdf.samples.sigma)
    with pytest.raises(FormatError, match=r"column sigma: a standard deviation is negative"):
        read(tmp_path, text.replace("-0.01\n", "-0.01,-1\n"))


def test_means_of_duplicates_have_less_noise(tmp_path: Path) -> None:
    rows = "30,0,40,180,0.5,0.2,0.1,0.03\n30,0,40,180,0.7,0.2,0.1,0.04\n"
    head = PLAIN.split("30,0")[0].replace("r,g,b", "r,g,b,sigma")
    sigma = read(tmp_path, head + rows).samples.sigma
    np.testing.assert_allclose(sigma, [0.025])


def test_rows_without_values_are_left_out_and_counted(tmp_path: Path) -> None:
    brdf = read(tmp_path, PLAIN + "10,0,10,180,,,\n20,0,20,180,,,\n")
    assert len(brdf.samples) == 2
    assert brdf.describe()["rows without values"] == 2
    with pytest.raises(FormatError, match="line 6: column g: '' is not a finite number"):
        read(tmp_path, PLAIN.replace("0.4,0.1,-0.01", "0.4,,0.1"))
    plan = "\n".join([*PLAIN.splitlines()[:4], "10,0,10,180,,,"])
    with pytest.raises(FormatError, match="a plan that is not filled in, from line 5 on"):
        read(tmp_path, plan)


@pytest.mark.parametrize("sigma", [None, [0.05, 0.02]])
def test_a_plan_keeps_what_was_measured(tmp_path: Path, sigma: list[float] | None) -> None:
    rng = np.random.default_rng(1)
    wi, wo = hemisphere(rng, 2), hemisphere(rng, 2)
    measured = ScatteredBrdf(wi, wo, [[0.5, 0.25, 0.125], [1, 2, 3]], "paint", sigma=sigma)
    more = hemisphere(rng, 3), hemisphere(rng, 3)
    comma_separated.save_plan(*more, tmp_path / "next.csv", name="paint", measured=measured)
    text = (tmp_path / "next.csv").read_text()
    assert text.count(",,,\n" if sigma is None else ",,,,\n") == 3
    back = nacre.load(tmp_path / "next.csv")
    np.testing.assert_allclose(back.samples.wi, wi, atol=1e-7)
    np.testing.assert_array_equal(back.samples.rgb, measured.samples.rgb)
    assert (back.samples.sigma is None) == (sigma is None)
    filled = text.replace(",,,,\n", ",1,1,1,0.1\n").replace(",,,\n", ",1,1,1\n")
    (tmp_path / "filled.csv").write_text(filled)
    again = nacre.load(tmp_path / "filled.csv").samples
    np.testing.assert_allclose(again.wo, np.concatenate([wo, more[1]]), atol=1e-6)


def test_remarks_and_blank_lines_before_the_columns_are_no_stray_text(tmp_path: Path) -> None:
    text = PLAIN.replace("theta_i,", "\n# measured on a rainy day\n\ntheta_i,", 1)
    np.testing.assert_array_equal(
        read(tmp_path, text).samples.rgb, [[0.5, 0.2, 0.1], [0.4, 0.1, -0.01]]
    )


@pytest.mark.parametrize("value", ["f", "F", "brdf", "bsdf", "f_r", "BRDF [1/sr]"])
@pytest.mark.parametrize("view", ["theta_o,phi_o", "theta_s,phi_s", "theta_r,phi_r"])
def test_names_that_laboratories_give_columns(tmp_path: Path, value: str, view: str) -> None:
    names = f"theta_i,phi_i,{view}"
    brdf = read(tmp_path, f"# units: degrees\n{names},{value}\n30,10,40,180,0.25\n")
    np.testing.assert_array_equal(brdf.samples.rgb, [[0.25, 0.25, 0.25]])
    expected = join(from_spherical(*np.radians([[40.0], [180.0]])))
    np.testing.assert_allclose(brdf.samples.wo, expected, atol=1e-15)
