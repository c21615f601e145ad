"""TracePro's surface properties and pab-opto's scans: by hand, by closed forms, by Radiance."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.errors import FormatError
from nacre.formats import identify
from nacre.geometry import cosine_hemisphere, join
from tests.specimens import SPECIMENS

TRACEPRO, PAB = SPECIMENS["TracePro surface property"], SPECIMENS["pab-opto scan"]


def vector(theta: float, phi: float) -> np.ndarray:
    polar, turn = np.radians(theta), np.radians(phi)
    return np.array([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)])


# TracePro


def test_tracepro_rows_lie_about_the_mirror_direction(tmp_path: Path) -> None:
    """By hand: 30 degrees of incidence; 0.2 farther from the light is a sine of 0.7."""
    path = tmp_path / "paint.txt"
    path.write_bytes(TRACEPRO.files()[0])
    brdf = nacre.load(path)
    assert identify(path).name == "TracePro surface property"
    assert brdf.name == "paint"
    assert brdf.channels == ("550 nm",) * 3
    assert brdf.isotropic
    samples = brdf.samples
    (index,) = np.flatnonzero(np.isclose(samples.wo[:, 0], -0.7))
    np.testing.assert_allclose(samples.wo[index], [-0.7, 0.0, np.sqrt(0.51)], atol=1e-6)
    np.testing.assert_allclose(samples.wi[index], vector(30.0, 0.0), atol=1e-6)
    assert samples.rgb[index] == pytest.approx([0.4] * 3)


def test_tracepro_model_is_its_formula(tmp_path: Path) -> None:
    path = tmp_path / "paint.txt"
    path.write_bytes(TRACEPRO.files()[1])
    samples = nacre.load(path).samples
    assert len(np.unique(np.round(samples.wi[:, 2], 6))) == 18  # its light stands for all
    distance = np.linalg.norm(samples.wo[:, :2] + samples.wi[:, :2], axis=1)
    np.testing.assert_allclose(samples.rgb[:, 1], 0.3 / (0.1 + distance**1.5), rtol=1e-5)


def test_tracepro_elliptic_model_is_wider_across(tmp_path: Path) -> None:
    text = TRACEPRO.files()[1].decode()
    text = text.replace("\tBRDF_g", "\tBRDF_g\tBRDF_By\tBRDF_gy").replace(
        "\t1.5\n", "\t1.5\t0.4\t1\n"
    )
    path = tmp_path / "paint.txt"
    path.write_text(text)
    brdf = nacre.load(path)
    wi = vector(30.0, 0.0)
    sides = [(-0.7, 0.0), (-0.5, 0.2)]  # 0.2 from the mirror direction in the plane, and across
    wo = [np.array([x, y, np.sqrt(1.0 - x * x - y * y)]) for x, y in sides]
    along, across = (brdf.eval(wi, w)[0] for w in wo)
    assert along == pytest.approx(0.3 / (0.1 + 0.2**1.5), rel=0.02)
    assert across == pytest.approx(0.3 / (0.4 + 0.2), rel=0.02)


def test_tracepro_notes_and_bands(tmp_path: Path) -> None:
    text = TRACEPRO.files()[0].decode()
    row = "300\t0.55\t30\t0\t0.4\t240\t0.3\t0\n"
    assert row in text
    rows = [line for line in text.splitlines(True) if line.count("\t") == 7 and line[0] == "3"]
    second = "".join(rows).replace("\t0.55\t", "\t0.905\t")
    text = text.replace(row, row.replace("\t0\n", "\t0.1\n") + second)
    path = tmp_path / "paint.txt"
    path.write_text(text.replace("30\t0\t0\t0\t", "30\t0\t0.4\t0.2\t", 1))
    brdf = nacre.load(path)
    np.testing.assert_allclose(brdf.wavelengths, [550.0, 905.0])
    assert any("transmission" in note for note in brdf.notes)
    assert any("mirror image of up to 0.4" in note for note in brdf.notes)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("\t0.5\t0\n", "\tx\t0\n", "line 9: 'x' is no number"),
        ("\t0.5\t0\n", "\t0.5\n", "line 9: 7 numbers, expected 8"),
        ("\tScatterBeta", "\tScatterBeta\tScatterBeta", "expected 9"),
        ("0.55\t30\t0\t0.2\t0\t", "0.55\t95\t0\t0.2\t0\t", "IncAngle"),
        ("0.55\t30\t0\t0.2\t0\t", "-1\t30\t0\t0.2\t0\t", "Wavelength"),
        ("\t30\t0\t0.2\t0\t", "\t30\t0\t-0.2\t0\t", "ScatterBeta"),
        ("\tBRDF\t", "\tBRDFs\t", "no column brdf"),
    ],
)
def test_bad_tracepro_is_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    text = TRACEPRO.files()[0].decode()
    assert old in text
    path = tmp_path / "paint.txt"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(FormatError, match=words):
        nacre.load(path)


def test_a_tracepro_mirror_has_no_reflectance(tmp_path: Path) -> None:
    path = tmp_path / "mirror.txt"
    path.write_text(TRACEPRO.files()[1].decode().replace("\t0.3\t0.1\t1.5", "\t0\t0.1\t1.5"))
    with pytest.raises(FormatError, match="holds no scattered reflection"):
        nacre.load(path)


# pab-opto


def tilted(wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """A wide highlight about a normal that leans to +x and less to +y."""
    normal = np.array([0.3, 0.15, 1.0]) / np.linalg.norm([0.3, 0.15, 1.0])
    half = wi + wo
    half = half / np.linalg.norm(half, axis=-1, keepdims=True)
    return np.asarray(0.1 + 2.0 * np.exp((half @ normal - 1.0) / 0.05))


def write_scan(folder: Path, lights: list[tuple[int, int]], header: str = "") -> None:
    folder.mkdir(exist_ok=True)
    polars = np.degrees(np.arccos(np.linspace(0.05, 1.0, 14)))
    views = [(float(t), float(p)) for t in polars for p in range(0, 360, 10)]
    for light in lights:
        rows = []
        for view in views:
            value = tilted(vector(*light), vector(*view)) * np.cos(np.radians(view[0]))
            rows.append(f"{view[0]:.4f}\t{view[1]:.4f}\t{value:.6g}\r\n")
        head = f'#sample_name "tilted"\r\n#format: theta phi DSF\r\n{header}'
        head += f"#incident_angle {light[0]} {light[1]}\r\n"
        (folder / f"t{light[0]:02}p{light[1]:03}.txt").write_text(head + "".join(rows), newline="")


AROUND = [(0, 0)] + [(polar, turn) for polar in (30, 60) for turn in range(0, 360, 60)]


def test_a_folder_of_pab_files_is_one_scan(tmp_path: Path) -> None:
    """Radiance's frame: the azimuth 0 of a file without #upphi is up, which is +y."""
    write_scan(tmp_path / "tilted", AROUND)
    (tmp_path / "tilted" / "photo.jpg").write_bytes(b"\xff\xd8")
    brdf = nacre.load(tmp_path / "tilted")
    assert identify(tmp_path / "tilted").name == "pab-opto scan"
    assert brdf.name == "tilted"
    assert not brdf.isotropic
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # a quarter turn
    samples = brdf.samples
    np.testing.assert_allclose(samples.rgb[:, 0], tilted(samples.wi @ turn, samples.wo @ turn),
                               rtol=2e-3)  # fmt: skip


def test_up_turns_a_pab_scan(tmp_path: Path) -> None:
    write_scan(tmp_path / "scan", AROUND, "#upphi 90\r\n")
    samples = nacre.load(tmp_path / "scan").samples
    np.testing.assert_allclose(samples.rgb[:, 0], tilted(samples.wi, samples.wo), rtol=2e-3)


def test_one_pab_file_is_one_angle_of_an_isotropic_scan(tmp_path: Path) -> None:
    path = tmp_path / "paint.txt"
    path.write_bytes(PAB.files()[0])
    brdf = nacre.load(path)
    assert identify(path).name == "pab-opto scan"
    assert brdf.isotropic
    np.testing.assert_allclose(brdf.samples.wi[:, 2], np.cos(np.radians(30.0)), rtol=1e-6)
    # DSF has the cosine, f_r does not.
    (index,) = np.flatnonzero(np.isclose(brdf.samples.wo[:, 2], 0.5))
    assert brdf.samples.rgb[index] == pytest.approx([0.4] * 3)


def test_a_quarter_of_the_lights_stands_for_all(tmp_path: Path) -> None:
    write_scan(tmp_path / "scan", [(0, 0), (40, 0), (40, 45), (40, 90)], "#upphi 90\r\n")
    brdf = nacre.load(tmp_path / "scan")
    assert any("quadrilateral" in note for note in brdf.notes)
    wi, wo = vector(40.0, 45.0), vector(20.0, 200.0)
    for mirror in ([-1, 1, 1], [1, -1, 1], [-1, -1, 1]):
        np.testing.assert_allclose(
            brdf.eval(wi * mirror, wo * mirror), brdf.eval(wi, wo), rtol=1e-4
        )


def test_colors_and_transmission_of_a_pab_file(tmp_path: Path) -> None:
    path = tmp_path / "paint.txt"
    path.write_text("#format: theta phi BSDF\n#colorimetry: CIE-XYZ\n#intheta 30\n#inphi 0\n"
                    "20 180 0.9505 1 1.089\n150 180 0.2 0.2 0.2\n")  # fmt: skip
    brdf = nacre.load(path)
    np.testing.assert_allclose(brdf.samples.rgb, [[1.0, 1.0, 1.0]], atol=2e-3)
    assert any("transmission from the front" in note for note in brdf.notes)
    path.write_text("#format: theta phi BTDF\n#intheta 30\n#inphi 0\n150 180 0.2\n")
    with pytest.raises(FormatError, match="no reflection of the front, but transmission"):
        nacre.load(path)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("DSF", "counts", "#format"),
        ("#incident_angle 30 180\r\n", "", "no line #incident_angle"),
        ("#incident_angle 30 180", "#incident_angle 30", "has 1 numbers, expected 2"),
        ("#incident_angle 30", "#incident_angle x", "#incident_angle: 'x' is no number"),
        ("#incident_angle 30", "#incident_angle 190", "polar angles"),
        ("\t0.1\r\n", "\t0.1\t3\r\n", "line 4: 4 numbers, expected 3"),
        ("#format", "#colorimetry: LAB\r\n#format", "#colorimetry"),
    ],
)
def test_bad_pab_is_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    text = PAB.files()[0].decode()
    assert old in text
    path = tmp_path / "paint.txt"
    path.write_text(text.replace(old, new, 1), newline="")
    with pytest.raises(FormatError, match=words):
        nacre.load(path)


def test_two_samples_in_a_folder_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_bytes(PAB.files()[0])
    (tmp_path / "b.txt").write_bytes(PAB.files()[0].replace(b"paint", b"other"))
    with pytest.raises(FormatError, match="samples 'other' and 'paint'"):
        nacre.load(tmp_path)


def test_a_folder_is_fitted_as_one(tmp_path: Path) -> None:
    from tests.cli.support import run

    write_scan(tmp_path / "scan", AROUND)
    output = tmp_path / "fit.safetensors"
    run("fit", tmp_path / "scan", "-o", output, "--preset", "draft", "--epochs", "1")
    assert nacre.load(output).name == "tilted"


@pytest.mark.slow
def test_radiance_reads_a_pab_scan_as_we_do(tmp_path: Path) -> None:
    """Its interpolant, as a tensor tree of 8 x 8 patches, against the scan."""
    radiance = pytest.importorskip("pyradiance")
    programs = Path(radiance.__file__).parent / "bin"
    write_scan(tmp_path / "scan", AROUND)
    files = sorted((tmp_path / "scan").iterdir())
    tree = tmp_path / "tree.xml"
    found = f"{programs}{os.pathsep}{os.environ['PATH']}"
    environment = os.environ | {"PATH": found, "RAYPATH": str(programs.parent / "lib")}
    with (tmp_path / "a.sir").open("wb") as sir:
        subprocess.run([programs / "pabopto2bsdf", *files], stdout=sir, check=True)
    with tree.open("wb") as xml:
        command = [programs / "bsdf2ttree", "-g", "4", "-p0", tmp_path / "a.sir"]
        subprocess.run(command, stdout=xml, check=True, env=environment)
    ours, theirs = nacre.load(tmp_path / "scan"), nacre.load(tree)
    random = np.random.default_rng(1)
    wi, wo = (join(cosine_hemisphere(*random.random((2, 4000)))) for _ in range(2))
    inside = (wi[:, 2] > 0.55) & (wo[:, 2] > 0.4)
    wi, wo = wi[inside], wo[inside]
    found = np.log(ours.eval(wi, wo)[:, 1])
    agreement = []
    for turns in range(4):
        for side in (1.0, -1.0):  # turned by quarters, and mirrored
            turn = np.linalg.matrix_power(
                [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], turns
            )
            moved = turn @ np.diag([side, 1.0, 1.0])
            expected = np.log(theirs.eval(wi @ moved.T, wo @ moved.T)[:, 1] + 1e-3)
            agreement.append(float(np.corrcoef(found, expected)[0, 1]))
    assert agreement[0] > 0.85
    assert max(agreement[1:]) < agreement[0] - 0.1
