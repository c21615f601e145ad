"""Scans through wide apertures: what they would be through the smallest, and what files say."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

import nacre
from nacre.analytic import MODELS
from nacre.errors import FormatError
from nacre.geometry import from_spherical, join
from nacre.measured import ScatteredBrdf
from nacre.numerics.direction_samples import DirectionSamples
from nacre.sampling.apertures import aperture_nodes, half_angle, seen_through, solid_angle
from nacre.spectra import narrowed, to_rgb
from tests.data import require_data

Matrix = npt.NDArray[np.float64]
GLOSSY = MODELS["ggx"](
    diffuse=(0.1, 0.12, 0.2), specular=(0.05, 0.05, 0.05), roughness=0.05, name="glossy"
)


def pairs() -> tuple[Matrix, Matrix]:
    """In the plane of incidence, every degree near the mirror direction."""
    rows = [
        (light, abs(view), np.pi if view >= 0.0 else 0.0)
        for light in np.radians((10.0, 25.0, 40.0, 55.0))
        for view in light + np.radians(np.r_[-10:10.5, -60:-10:10, 12:24:3])
    ]
    light, view, phi = np.array(rows).T
    wi, wo = join(from_spherical(light, 0.0 * light)), join(from_spherical(view, phi))
    return wi.astype(np.float64), wo.astype(np.float64)


def seen(brdf: nacre.Brdf, wi: Matrix, wo: Matrix, half: float) -> Matrix:
    """Means over the detector's cone, by ten thousand random directions."""
    random = np.random.default_rng(3)
    cosine = 1.0 - (1.0 - np.cos(half)) * random.random(10_000)
    phi = 2.0 * np.pi * random.random(10_000)
    sine = np.sqrt(1.0 - cosine**2)
    values = []
    for a, b in zip(wi, wo, strict=True):
        x = np.cross(b, [0.0, 1.0, 0.0])
        x /= np.linalg.norm(x)
        y = np.cross(b, x)
        view = (sine * np.cos(phi))[:, None] * x + (sine * np.sin(phi))[:, None] * y
        view += cosine[:, None] * b
        weight = np.maximum(view[:, 2:], 0.0)
        values.append((weight * brdf.eval(a, view)).sum(axis=0) / weight.sum())
    return np.array(values)


def test_means_over_an_aperture_agree_with_random_directions() -> None:
    wi, wo = (w[::9] for w in pairs())
    samples = DirectionSamples(
        wi, wo, np.ones((len(wi), 3)), None, np.tile([0.0, 0.05], (len(wi), 1))
    )
    found = seen_through(GLOSSY.eval, samples)
    np.testing.assert_allclose(found, seen(GLOSSY, wi, wo, 0.05), rtol=0.05)


def test_directions_lie_in_their_cones_and_count_as_much_as_their_cosines() -> None:
    wi, wo = pairs()
    cones = np.tile([0.02, 0.07], (len(wi), 1))
    a, b, weights = aperture_nodes(DirectionSamples(wi, wo, wi, None, cones), 64)
    for axis, around, half in ((wi, a, 0.02), (wo, b, 0.07)):
        angle = np.arccos(np.clip((axis[:, None] * around).sum(axis=2), -1.0, 1.0))
        assert angle.max() < half
        assert np.median(angle) == pytest.approx(half / np.sqrt(2.0), rel=0.05)
    np.testing.assert_allclose(weights.mean(axis=1), 1.0)
    np.testing.assert_allclose(weights * b[..., 2].mean(axis=1)[:, None], b[..., 2], rtol=1e-6)
    # One end of the source's cone does not go with one end of the detector's.
    tilt = [(w - axis[:, None])[:, :, 0] for axis, w in ((wi, a), (wo, b))]
    assert abs(np.corrcoef(tilt[0].reshape(-1), tilt[1].reshape(-1))[0, 1]) < 0.3


def test_an_aperture_at_the_horizon_is_what_is_above_it() -> None:
    wi = np.array([[0.0, 0.0, 1.0]])
    wo = np.array([[np.sqrt(1.0 - 1e-4), 0.0, 1e-2]])
    flat = DirectionSamples(wi, wo, wi, None, np.array([[0.1, 0.1]]))
    lambert = MODELS["lambert"](diffuse=(0.5, 0.5, 0.5))
    np.testing.assert_allclose(seen_through(lambert.eval, flat), 0.5 / np.pi, rtol=1e-5)


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_a_highlight_is_as_high_as_it_is_and_not_as_the_detector_saw_it(noise: float) -> None:
    wi, wo = pairs()
    exact, wide = GLOSSY.eval(wi, wo), seen(GLOSSY, wi, wo, np.radians(2.5))
    near = exact.mean(axis=1) > 0.2 * exact.max()
    random = np.random.default_rng(1)
    wide = wide * (1.0 + noise * random.normal(size=(len(wi), 1)))
    scan = ScatteredBrdf(wi, wo, wide).through(0.0, 2.5)
    taken = scan.scattered()
    assert taken is not None
    before, after = (
        np.sqrt(np.square(np.log(values / exact)).mean(axis=1))
        for values in (wide, taken.samples.rgb)
    )
    assert before[near].mean() > 0.13
    assert after[near].mean() < 0.015 + 1.2 * noise
    assert after.max() < 0.06 + 4.0 * noise
    np.testing.assert_array_equal(scan.samples.rgb, wide)  # as measured
    np.testing.assert_allclose(scan.eval(wi, wo), taken.samples.rgb, rtol=1e-4)
    assert taken.samples.apertures is None


def test_a_matte_scan_stays_as_it_is() -> None:
    wi, wo = pairs()
    lambert = MODELS["lambert"](diffuse=(0.5, 0.4, 0.3))
    scan = ScatteredBrdf(wi, wo, lambert.eval(wi, wo)).through(1.0, 5.0)
    taken = scan.scattered()
    assert taken is not None
    np.testing.assert_allclose(taken.samples.rgb, scan.samples.rgb, rtol=1e-6)


def test_values_that_are_not_measured_stay_negative_and_bands_are_undone_alike() -> None:
    wi, wo = pairs()
    wide = seen(GLOSSY, wi, wo, np.radians(2.5))
    wide[3, 2] = -0.1
    scan = ScatteredBrdf(
        wi, wo, wide, spectra=np.maximum(wide, 0.0), wavelengths=[450, 550, 650]
    ).through(0.0, 2.5)
    taken = scan.scattered()
    assert isinstance(taken, ScatteredBrdf)
    assert taken.samples.rgb[3, 2] == -0.1
    assert taken.spectra is not None
    np.testing.assert_allclose(taken.spectra[:, 0], taken.samples.rgb[:, 0], rtol=0.02)
    assert scan.in_bands([650]).samples.rgb.max() == pytest.approx(wide[:, 2].max())


def test_other_channels_and_apertures_forget_what_was_computed_before() -> None:
    wi, wo = pairs()
    wide = seen(GLOSSY, wi, wo, np.radians(2.5))
    scan = ScatteredBrdf(wi, wo, wide, spectra=2.0 * wide, wavelengths=[450, 550, 650])
    before = scan.eval(wi, wo)
    assert scan.through(0.0, 2.5).eval(wi, wo).max() > 1.2 * before.max()
    np.testing.assert_allclose(scan.in_bands([450]).eval(wi, wo)[:, 0], 2.0 * before[:, 0], 1e-4)


@pytest.mark.parametrize("wrong", [(-1.0, 0.0), (0.0, 90.0), (np.nan, 1.0)])
def test_wrong_apertures_are_refused(wrong: tuple[float, float]) -> None:
    wi, wo = pairs()
    with pytest.raises(ValueError, match="degrees"):
        ScatteredBrdf(wi, wo, np.ones((len(wi), 3))).through(*wrong)
    with pytest.raises(ValueError, match="apertures"):
        ScatteredBrdf(wi, wo, np.ones((len(wi), 3)), apertures=np.radians(wrong))


def test_solid_angles_are_those_of_cones() -> None:
    assert solid_angle(np.pi / 2) == pytest.approx(2.0 * np.pi)
    for half in (1e-5, 0.04, 1.2):
        assert half_angle(solid_angle(half)) == pytest.approx(half, rel=1e-9)


ROWS = "30,0,40,180,0.5\n60,10,20,-90,0.4\n"
HEAD = "# units: degrees\n"
COLUMNS = "theta_i,phi_i,theta_o,phi_o,f"


def read(tmp_path: Path, text: str) -> DirectionSamples:
    (tmp_path / "a.csv").write_text(text)
    brdf = nacre.load(tmp_path / "a.csv")
    nacre.save(brdf, tmp_path / "b.csv")
    again = nacre.load(tmp_path / "b.csv")
    nacre.save(again, tmp_path / "c.csv")
    assert (tmp_path / "b.csv").read_bytes() == (tmp_path / "c.csv").read_bytes()
    for name in ("apertures", "sigma"):
        values = getattr(brdf.samples, name)
        if values is not None:
            np.testing.assert_allclose(getattr(again.samples, name), values, rtol=1e-7)
    return brdf.samples


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        ("# source aperture: 0.5 deg\n# detector aperture: 2.5 degrees\n", (0.5, 2.5)),
        ("# detector aperture: 0.05 rad\n", (0.0, np.degrees(0.05))),
        ("detector aperture: 0.002194 sr\n", (0.0, 1.5141)),
    ],
)
def test_apertures_stand_in_the_header(
    tmp_path: Path, lines: str, expected: tuple[float, float]
) -> None:
    samples = read(tmp_path, f"{HEAD}{lines}{COLUMNS}\n{ROWS}")
    np.testing.assert_allclose(np.degrees(samples.apertures), [expected, expected], rtol=1e-4)


def test_apertures_stand_in_columns(tmp_path: Path) -> None:
    rows = ROWS.replace("\n", ",1\n", 1).replace("0.4\n", "0.4,2\n")
    samples = read(tmp_path, f"{HEAD}{COLUMNS},detector_aperture\n{rows}")
    np.testing.assert_allclose(np.degrees(samples.apertures), [(0.0, 1.0), (0.0, 2.0)])
    solid = read(tmp_path, f"{HEAD}{COLUMNS},detector_aperture [sr]\n{rows}")
    assert solid.apertures[0, 1] == pytest.approx(half_angle(1.0))


def test_rows_of_a_plan_with_apertures_are_left_out(tmp_path: Path) -> None:
    rows = ROWS.replace("0.5\n", "0.5,1\n").replace("0.4\n", ",2\n")
    assert len(read(tmp_path, f"{HEAD}{COLUMNS},detector_aperture\n{rows}")) == 1


@pytest.mark.parametrize(
    ("column", "line", "expected"),
    [
        ("sigma [%]", "", (0.01, 0.016)),
        ("uncertainty", "# coverage factor: 2\n", (1.0, 2.0)),
        ("std", "", (2.0, 4.0)),
    ],
)
def test_uncertainties_are_standard_ones_in_the_end(
    tmp_path: Path, column: str, line: str, expected: tuple[float, float]
) -> None:
    rows = ROWS.replace("0.5\n", "0.5,2\n").replace("0.4\n", "0.4,4\n")
    samples = read(tmp_path, f"{HEAD}{line}{COLUMNS},{column}\n{rows}")
    np.testing.assert_allclose(samples.sigma, expected)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (
            "# detector aperture: 2.5\n",
            "header 'detector aperture': '2.5', expected half the angle",
        ),
        ("# detector aperture: 95 deg\n", "detector aperture: must be half an angle"),
        ("# source aperture: 7 sr\n", "source aperture: must be half an angle"),
        ("# detector aperture: x deg\n", "expected half the angle"),
    ],
)
def test_bad_apertures_are_named(tmp_path: Path, lines: str, message: str) -> None:
    with pytest.raises(FormatError, match=message):
        read(tmp_path, f"{HEAD}{lines}{COLUMNS}\n{ROWS}")


@pytest.mark.parametrize("factor", ["0", "-2", "two", "1e999"])
def test_a_bad_coverage_factor_is_named(tmp_path: Path, factor: str) -> None:
    rows = ROWS.replace("0.5\n", "0.5,2\n").replace("0.4\n", "0.4,4\n")
    text = f"{HEAD}# coverage factor: {factor}\n{COLUMNS},sigma\n{rows}"
    with pytest.raises(FormatError, match=r"header 'coverage factor': .* expected one like 2"):
        read(tmp_path, text)


def test_the_solid_angle_of_a_bird_file_is_the_detectors_aperture() -> None:
    scan = nacre.load(require_data("field", "bird", "example.brdf"))
    np.testing.assert_allclose(scan.samples.apertures[0], [0.0, half_angle(0.002194)])
    assert scan.describe()["detector half-angle"] == "1.51 degrees"


def test_openmaterial_keeps_receivers_and_uncertainties(tmp_path: Path) -> None:
    wi, wo = pairs()
    spectra = np.stack([GLOSSY.eval(wi, wo)[:, 0]] * 2, axis=1)
    scan = ScatteredBrdf(
        *(wi, wo, spectra[:, [0, 1, 1]], "glossy"),
        spectra=spectra,
        wavelengths=[500.0, 600.0],
        sigma=0.1 * spectra[:, 0],
        apertures=[0.0, 0.04],
    )
    path = tmp_path / "glossy_brdf.xompt"
    nacre.save(scan, path)
    again = nacre.load(path)
    np.testing.assert_allclose(again.samples.apertures[0], [0.0, 0.04])
    np.testing.assert_allclose(again.samples.sigma, 0.1 * again.spectra[:, 0], rtol=1e-4)
    content = json.loads(path.read_text())
    content["brdf"]["standardUncertainties"][3] = -1.0
    path.write_text(json.dumps(content))
    with pytest.raises(FormatError, match="standardUncertainties: expected"):
        nacre.load(path)
    content["brdf"]["receiverSolidAngles"][0]["solidAngle"] = 0.0
    del content["brdf"]["standardUncertainties"]
    path.write_text(json.dumps(content))
    with pytest.raises(FormatError, match="solidAngle: must lie between"):
        nacre.load(path)


def test_apertures_are_told_where_files_do_not_say_them(tmp_path: Path) -> None:
    wi, wo = pairs()
    wide = seen(GLOSSY, wi, wo, np.radians(2.5))
    nacre.save(ScatteredBrdf(wi, wo, wide, "scan"), tmp_path / "scan.csv")
    told = nacre.load(tmp_path / "scan.csv", apertures=(0.0, 2.5))
    assert told.eval(wi, wo).max() > 1.2 * wide.max()
    assert "detector half-angle" in told.describe()
    with pytest.raises(FormatError, match="apertures: expected 0 to less than 90 degrees"):
        nacre.load(tmp_path / "scan.csv", apertures=(0.0, 100.0))
    with pytest.raises(FormatError, match="apertures: are for scans"):
        nacre.load("rgl:paper_white", apertures=(0.0, 1.0))


def test_bands_are_as_narrow_as_lines() -> None:
    """Against the integral over triangles, and the published coefficients."""
    wavelengths = np.arange(400.0, 701.0, 10.0)
    fine = np.arange(360.0, 740.0, 0.25)

    def spectrum(nm: Matrix) -> Matrix:
        return 0.3 + 0.2 * np.tanh((nm - 560.0) / 18.0) + 0.1 * np.sin(nm / 25.0)

    triangle = np.maximum(1.0 - np.abs(fine - wavelengths[:, None]) / 10.0, 0.0)
    seen = (triangle * spectrum(fine)).sum(axis=1) / triangle.sum(axis=1)
    found = narrowed(np.stack([seen, 2.0 * seen]), wavelengths, 10.0)
    before, after = (np.abs(x - spectrum(wavelengths))[1:-1].max() for x in (seen, found[0]))
    assert after < 0.25 * before
    np.testing.assert_allclose(found[1], 2.0 * found[0])
    delta = np.zeros(7)
    delta[3] = 1.0
    ten = np.arange(400.0, 461.0, 10.0)
    np.testing.assert_allclose(narrowed(delta, ten, 10.0)[2:5], [-1 / 12, 1 + 2 / 12, -1 / 12])
    np.testing.assert_allclose(narrowed(np.eye(7)[0], ten, 10.0)[:2], [1 + 1 / 12, -1 / 12])
    np.testing.assert_allclose(narrowed(np.ones(7), ten, 10.0), 1.0)


def test_the_bandwidth_of_a_scan_is_undone_and_written_again(tmp_path: Path) -> None:
    bands = ",".join(f"{nm} nm" for nm in range(400, 701, 50))
    rows = "".join(
        f"{theta},0,{theta},180,{','.join(str(x) for x in (0.1, 0.1, 0.1, 0.9, 0.1, 0.1, 0.1))}\n"
        for theta in range(0, 60, 5)
    )
    head = "# units: degrees\n# bandwidth: 50 nm\ntheta_i,phi_i,theta_o,phi_o,"
    path = tmp_path / "a.csv"
    path.write_text(f"{head}{bands}\n{rows}")
    scan = nacre.load(path)
    assert scan.describe()["bandwidth nm"] == 50.0
    assert scan.spectra[0, 3] == 0.9
    sharp = scan.eval_spectral(scan.samples.wi[:1], scan.samples.wo[:1])[0]
    assert sharp[3] == pytest.approx(0.9 + 2 * 0.8 / 12, rel=1e-5)
    taken = scan.scattered()
    assert isinstance(taken, ScatteredBrdf)
    np.testing.assert_allclose(taken.samples.rgb, to_rgb(taken.spectra, taken.wavelengths))
    red = scan.in_bands([550]).scattered()
    assert red is not None
    assert red.samples.rgb[0, 0] == pytest.approx(sharp[3], rel=1e-5)
    nacre.save(scan, tmp_path / "b.csv")
    again = nacre.load(tmp_path / "b.csv")
    assert again.bandwidth == 50.0
    np.testing.assert_array_equal(again.spectra, scan.spectra)
    path.write_text(f"{head}{bands}\n{rows}".replace("50 nm\n", "wide\n", 1))
    with pytest.raises(FormatError, match="header 'bandwidth': 'wide', expected one like 10 nm"):
        nacre.load(path)
