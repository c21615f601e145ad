"""SSDD, FRED, LightTools, Speos' anisotropic files and BiRD's: written and read, and bad ones."""

from __future__ import annotations

import json
import math
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.analytic import MODELS, AnalyticBrdf, Ggx
from nacre.errors import FormatError
from nacre.io.lz4 import unpacked_block
from nacre.measured.scattered import ScatteredBrdf
from nacre.measured.speos_anisotropic import _places
from tests.data import require_data
from tests.measured.bird_schema import SCHEMA
from tests.tiers import tiered

PAINT = Ggx(name="paint", diffuse=(0.3, 0.1, 0.05), specular=(0.05,) * 3, roughness=0.3)
GRAY = Ggx(name="gray", diffuse=(0.2,) * 3, specular=(0.05,) * 3, roughness=0.3)
BRUSHED = MODELS["ggx-anisotropic"](
    diffuse=(0.1,) * 3,
    specular=(0.4,) * 3,
    roughness_x=0.25,
    roughness_y=0.6,
    angle=0.0,
    name="brushed",
)


def pairs(count: int = 300) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    z, phi = rng.uniform(0.35, 1.0, (2, count)), rng.uniform(0.0, 2.0 * math.pi, (2, count))
    r = np.sqrt(1.0 - z * z)
    wi, wo = np.stack([r * np.cos(phi), r * np.sin(phi), z], -1)
    return wi, wo


ENDINGS = [".ssdd", ".fred.txt", ".anisotropicbsdf", ".zemax.bsdf", ".bird.brdf"]
WRITTEN = [(ending, material) for ending in ENDINGS for material in (GRAY, BRUSHED)]


@pytest.mark.parametrize(
    ("ending", "material"),
    tiered(WRITTEN, lambda case: case[1] is GRAY or case[0] == ".zemax.bsdf"),
    ids=str,
)
def test_what_is_written_is_read(tmp_path: Path, ending: str, material: AnalyticBrdf) -> None:
    path = tmp_path / f"a{ending}"
    nacre.save(material, path)
    back = nacre.load(path)
    assert back.isotropic == material.isotropic
    wi, wo = pairs()
    ratio = back.eval(wi, wo)[:, 1] / material.eval(wi, wo)[:, 1]
    assert np.median(np.abs(ratio - 1.0)) < (0.01 if material is GRAY else 0.05)
    if not material.isotropic:  # not turned by a right angle
        turned = (
            np.stack([-wo[:, 1], wo[:, 0], wo[:, 2]], -1),
            np.stack([-wi[:, 1], wi[:, 0], wi[:, 2]], -1),
        )
        wrong = back.eval(*turned)[:, 1] / material.eval(wi, wo)[:, 1]
        assert np.median(np.abs(wrong - 1.0)) > 0.1


@pytest.mark.parametrize("ending", [".ssdd", ".bird.brdf"])
def test_bands_and_colors_are_kept(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"a{ending}"
    nacre.save(PAINT, path)
    wi, wo = pairs()
    found, true = nacre.load(path).eval(wi, wo), PAINT.eval(wi, wo)
    np.testing.assert_allclose(np.median(found / true, axis=0), 1.0, rtol=0.02)


# SSDD

SSDD = """VERSION 0.2
# a comment
DATA_TYPE specular_reflectance
COLOR_MODEL monochrome
PARAM0_LIST 0 90
DATA ascii
0.05
0.05
DATA_TYPE brdf
COLOR_MODEL rgb
PARAM_TYPE half_difference_coordinate_system
REDUCTION_TYPE bilateral_symmetry reciprocity
PARAM0_LIST 0 30
PARAM2_LIST 0 20 40
PARAM3_LIST 0 90
NAME blue # what it is
DATA {mode}
"""


def test_ssdd_follows_its_specification(tmp_path: Path) -> None:
    values = np.arange(36, dtype=np.float32).reshape(12, 3) * 0.01
    rows = "".join(f"{r:.6g} {g:.6g}\t{b:.6g}\n# PARAM\n" for r, g, b in values.tolist())
    for mode, table in (("ascii", rows.encode()), ("binary", values.astype("<f4").tobytes())):
        path = tmp_path / f"{mode}.ssdd"
        path.write_bytes(SSDD.format(mode=mode).encode() + table)
        scan = nacre.load(path)
        assert scan.name == "blue"
        assert "The file also holds specular_reflectance, which is left out." in scan.notes
        # PARAM0 is the fastest: theta_h 30, theta_d 20, phi_d 0 degrees is the third row's pair.
        t = math.radians(50.0), math.radians(10.0)
        wi, wo = [math.sin(t[0]), 0, math.cos(t[0])], [math.sin(t[1]), 0, math.cos(t[1])]
        index = int(scan.nearest(np.array([wi]), np.array([wo]))[0])
        assert scan.samples.rgb[index] == pytest.approx(values[3], abs=1e-6)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("VERSION 0.2", "RELEASE 1", "is of no known format"),
        ("DATA_TYPE brdf", "DATA_TYPE btdf", "holds no brdf, but specular_reflectance and btdf"),
        ("COLOR_MODEL rgb", "COLOR_MODEL hsv", "COLOR_MODEL: 'hsv'"),
        ("PARAM2_LIST 0 20 40\n", "", "PARAM2_LIST is missing"),
        ("PARAM2_LIST 0 20 40", "PARAM2_LIST 0 20 10", "PARAM2_LIST: must be"),
        ("PARAM_TYPE half_", "PARAM_TYPE full_", "PARAM_TYPE: 'full_difference"),
        ("DATA ascii\n0.05", "DATA morse\n0.05", "DATA: 'morse'"),
        ("0.05\n0.05", "0.05\nx", "is no number"),
        ("PARAM2_LIST 0 20 40", "PARAM2_LIST " + " ".join(map(str, range(90))), "do not fit"),
    ],
)
def test_bad_ssdd_is_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    path = tmp_path / "bad.ssdd"
    text = SSDD.format(mode="ascii") + 12 * "0.1 0.2 0.3\n"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(FormatError) as caught:
        nacre.load(path)
    assert words in str(caught.value)


# FRED and LightTools

FRED = "type bsdf_data\nformat angles=deg bsdf=value scale=2\n30 0\n30 0 0.5\n40 90 0.1\n"


def test_fred_scales_and_units(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text(FRED)
    scan = nacre.load(path)
    assert scan.samples.rgb[:, 0].tolist() == [1.0, 0.2]
    light = scan.samples.wi[0]
    assert light == pytest.approx([-0.5, 0.0, math.cos(math.radians(30.0))])
    path.write_text(FRED.replace("bsdf=value scale=2", "bsdf=log10").replace("0.5\n", "-1\n"))
    assert nacre.load(path).samples.rgb[0, 0] == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("format", "shape", "expected 'format angles=deg"),
        ("deg", "gon", "angles='gon'"),
        ("value", "dB", "bsdf='db'"),
        ("scale=2", "scale=x", "scale='x' is no number"),
        ("30 0\n", "", "expected a light of 2 numbers"),
        ("30 0 0.5", "30 0 0.5 7", "4 numbers, expected 2 or 3"),
        ("0.5", "half", "is no number"),
        ("30 0 0.5\n40 90 0.1\n", "", "holds no samples"),
    ],
)
def test_bad_fred_is_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    path = tmp_path / "bad.txt"
    path.write_text(FRED.replace(old, new, 1))
    with pytest.raises(FormatError) as caught:
        nacre.load(path)
    assert words in str(caught.value)


LIGHTTOOLS = """# LightTools
Symmetry Asymmetric
SpectralContent Monochrome
ScatterAzimuth 4
0 90 180 270
ScatterRadial 2
0 30
DataBegin
AOI 30
POI 0
Side Front
Wavelength 550
ScatterType BRDF
TIS 0.4
0.1 0.2 0.1 0.3 0.1 0.2 0.1 0.9
AOI 30 POI 0 Side Front Wavelength 550 ScatterType BTDF TIS 0.4
0 0 0 0 0 0 0 0
DataEnd
"""


def test_lighttools_light_comes_from_a_right_angle(tmp_path: Path) -> None:
    path = tmp_path / "a.bsdf"
    path.write_text(LIGHTTOOLS)
    scan = nacre.load(path)
    assert scan.notes == ("The file also holds the BTDF of the front, which is left out.",)
    t = math.radians(30.0)
    wi, mirror = [0.0, math.sin(t), math.cos(t)], [0.0, -math.sin(t), math.cos(t)]
    assert scan.eval(wi, mirror)[0] == pytest.approx(0.9)  # azimuth 270 degrees
    assert scan.eval(wi, wi)[0] == pytest.approx(0.3, rel=1e-4)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("Symmetry Asymmetric", "Symmetry Asymmetric Odd", "'Odd' is not known in the header"),
        ("DataBegin", "Begin", "'Begin' is not known in the header"),
        ("ScatterType BRDF", "ScatterType BTDF", "no reflection of the front, but BTDF"),
        ("AOI 30\n", "AOI 95\n", "AOI 95, expected 0 to 90"),
        ("0.9\n", "\n", "'AOI' is not a finite number"),
        ("DataEnd", "", "ends before DataEnd"),
        ("ScatterRadial 2\n0 30", "ScatterRadial 2\n30 0", "scatterradial: must increase"),
    ],
)
def test_bad_lighttools_is_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    path = tmp_path / "bad.bsdf"
    path.write_text(LIGHTTOOLS.replace(old, new, 1))
    with pytest.raises(FormatError) as caught:
        nacre.load(path)
    assert words in str(caught.value)


# Speos in binary


@pytest.mark.parametrize(
    ("packed", "length", "expected"),
    [
        (b"\x80" + bytes(8), 8, bytes(8)),
        (b"\x1fa\x01\x00\x05\x10b", 26, b"a" * 25 + b"b"),
        (b"\xf0\x05" + b"x" * 20, 20, b"x" * 20),
    ],
)
def test_lz4_blocks(packed: bytes, length: int, expected: bytes) -> None:
    assert unpacked_block(packed, length) == expected


@pytest.mark.parametrize(
    ("packed", "length"),
    [(b"\x80abc", 8), (b"\x10a\x05\x00", 9), (b"\x10a\x00\x00", 9), (b"\x1fa\x01\x00\xff", 9),
     (b"\x10a", 2), (b"\xf0", 20), (b"\x1fa\x01\x00" + b"\xff" * 99, 20)],
)  # fmt: skip
def test_damaged_lz4_is_refused(packed: bytes, length: int) -> None:
    with pytest.raises(ValueError, match=r"."):
        unpacked_block(packed, length)


def test_lz4_agrees_with_its_own_library() -> None:
    lz4 = pytest.importorskip("lz4.block", reason="needs lz4")
    data = np.linspace(0.0, 1.0, 500).tobytes() + bytes(1000)
    packed = lz4.compress(data, store_size=False)
    assert unpacked_block(packed, len(data)) == data


def test_a_binary_file_cut_or_damaged_is_refused(tmp_path: Path) -> None:
    data = require_data("field", "speos", "R_test.anisotropicbsdf").read_bytes()
    path = tmp_path / "cut.anisotropicbsdf"
    for length in range(60, 89_000, 2_900):
        path.write_bytes(data[:length])
        with pytest.raises(FormatError):
            nacre.load(path)
    rng = np.random.default_rng(0)
    for _ in range(60):
        changed = bytearray(data)
        place = int(rng.integers(0, 2_000))
        changed[place] ^= int(rng.integers(1, 255))
        path.write_bytes(bytes(changed))
        with suppress(FormatError):  # a changed value is no damage
            nacre.load(path)
    assert list(_places(bytes(100))) == []


# BiRD


def test_a_universal_file_is_written_back_whole(tmp_path: Path) -> None:
    source = require_data("field", "bird", "example.brdf")
    nacre.save(nacre.load(source), tmp_path / "b.bird.brdf")
    assert json.loads((tmp_path / "b.bird.brdf").read_text()) == json.loads(source.read_text())


def test_universal_files_meet_their_schemas(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    jsonschema = pytest.importorskip("jsonschema")
    check = jsonschema.Draft202012Validator(SCHEMA)
    source = require_data("field", "bird", "example.brdf")
    assert check.is_valid(json.loads(source.read_text("utf-8-sig")))
    wi = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]])
    gray = np.full((2, 3), 0.25)
    scan = ScatteredBrdf(wi, wi[::-1], gray, "noisy", sigma=np.array([0.01, 0.02]))
    spectral = ScatteredBrdf(wi, wi[::-1], gray, "bands", spectra=np.full((2, 2), 0.3),
                             wavelengths=np.array([550.0, 905.0]))  # fmt: skip
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "0")
    for number, brdf in enumerate((scan, spectral, PAINT, BRUSHED)):
        path = tmp_path / f"{number}.bird.brdf"
        nacre.save(brdf, path)
        document = json.loads(path.read_text())
        for entry in document["data"].values():
            entry["values"] = entry["values"][:200]
        check.validate(document)
        assert document["metadata"]["timestamp"] == "1970-01-01T00:00:00+00:00"
        again = nacre.load(path)
        assert again.name == brdf.name
    noise = nacre.load(tmp_path / "0.bird.brdf").samples.sigma
    np.testing.assert_allclose(noise, [0.01, 0.02], rtol=1e-5)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda d: d["data"].pop("theta_i"), "theta_i is missing"),
        (lambda d: d["data"].pop("BRDF"), "BRDF: has no list of values"),
        (lambda d: d["data"]["BRDF"].update(unit="lm"), "BRDF: unit 'lm', expected 1/sr"),
        (lambda d: d["data"]["theta_r"].update(unit="gon"), "theta_r: unit 'gon'"),
        (lambda d: d["data"]["phi_r"]["values"].pop(), "phi_r: 7 values, expected 8"),
        (lambda d: d["data"]["theta_r"]["values"].__setitem__(0, 95), "from 0 to 90 degrees"),
        (lambda d: d["data"]["BRDF"]["values"].__setitem__(0, "x"), "BRDF: a value is no finite"),
        (lambda d: d["data"]["polarization_i"]["values"].__setitem__(0, "q"), "'q' is neither"),
        (lambda d: d["data"]["wavelength_i"]["values"].__setitem__(0, 0), "must be positive"),
        (lambda d: d.pop("metadata"), "metadata: missing"),
    ],
)  # fmt: skip
def test_bad_universal_files_are_refused(tmp_path: Path, change: object, words: str) -> None:
    document = {
        "metadata": {"schema": "brdf_json_schema_v1.0.json", "sample": {"name": "s"}},
        "data": {
            "wavelength_i": {"unit": "nm", "values": [550, 550, 650, 650] * 2},
            "polarization_i": {"notation": "sp", "values": ["s", "p"] * 4},
            "theta_i": {"unit": "deg", "values": [0.0] * 8},
            "theta_r": {"unit": "°", "values": [10] * 4 + [20] * 4},
            "phi_r": {"unit": "deg", "values": [0.0] * 8},
            "BRDF": {"unit": "1/sr", "values": [0.1, 0.3, 0.2, 0.2] * 2},
            "uBRDF": {"unit": "%", "values": [5.0] * 8},
        },
    }
    path = tmp_path / "a.brdf"
    path.write_text(json.dumps(document))
    scan = nacre.load(path)
    assert scan.spectra.tolist() == [[0.2, 0.2], [0.2, 0.2]]
    assert scan.samples.sigma == pytest.approx([0.015, 0.015])
    change(document)  # type: ignore[operator]
    path.write_text(json.dumps(document))
    with pytest.raises(FormatError) as caught:
        nacre.load(path) if "metadata" in document else nacre.measured.bird.load(path)
    assert words in str(caught.value)
