"""Tables of OpenMATERIAL 3D, Zemax and Speos: definitions, round trips, refusals."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.errors import FormatError
from nacre.formats import writer
from nacre.geometry import from_spherical, join, split, to_spherical
from nacre.measured import openmaterial, specular_nodes
from nacre.sampling.energy import albedos
from tests.measured.support import hemisphere
from tests.specimens import SPECIMENS

SCHEMA = Path(__file__).parent / "openmaterial_brdf_schema.json"
ENDINGS = (".zemax.bsdf", ".brdf", "_brdf.xompt")


class Glossy(nacre.Brdf):
    """A base under a highlight at a width in slopes; gray, or yellow."""

    def __init__(self, color: tuple[float, ...] = (0.3, 0.25, 0.1), width: float = 0.15) -> None:
        super().__init__(name="glossy", source={"file": "made"})
        self.color, self.width = color, width

    def eval_components(self, wi, wo):
        x, y, z = (a + b for a, b in zip(wi, wo, strict=True))
        slope = (x * x + y * y) / np.maximum(z * z, 1e-9)
        shine = 0.5 * np.exp(-slope / self.width**2)
        return tuple(color / math.pi + shine for color in self.color)


@pytest.fixture(scope="module", params=ENDINGS)
def written(request: pytest.FixtureRequest, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("tables") / f"glossy{request.param}"
    writer(path, (12, 24, 10))(Glossy(), path)
    return path


def test_what_is_written_reads_as_it_was(written: Path) -> None:
    brdf, back = Glossy(), nacre.load(written)
    assert back.isotropic
    random = np.random.default_rng(2)
    wi, wo = (hemisphere(random, 3000) for _ in range(2))
    inside = np.minimum(wi[:, 2], wo[:, 2]) > 0.15  # beyond 81 degrees there are few nodes
    expected, found = brdf.eval(wi, wo)[inside], back.eval(wi, wo)[inside]
    assert np.abs(found - expected).mean() < 0.01 * expected.mean()
    np.testing.assert_allclose(found, expected, rtol=0.2, atol=0.02)


def test_samples_are_the_values_of_the_material(written: Path) -> None:
    """At the directions that the format's own angles say; the last digits are rounded."""
    samples = nacre.load(written).samples
    inside = np.minimum(samples.wi[:, 2], samples.wo[:, 2]) > 0.05
    expected = Glossy().eval(samples.wi, samples.wo)
    np.testing.assert_allclose(samples.rgb[inside], expected[inside], rtol=3e-3, atol=1e-5)


def test_zemax_tables_lie_about_the_mirror_direction(tmp_path: Path) -> None:
    """By hand: 40 degrees of incidence, 5 from the mirror direction toward the normal, and away."""
    path = tmp_path / "paint.bsdf"
    table = b"1\t2\n3\t4\n5\t6"
    content = SPECIMENS["Zemax BSDF"].files()[0].replace(b"0.2\t0.1\n0.2\t0.1\n0.25\t0.1", table)
    path.write_bytes(content)
    samples = nacre.load(path, as_stored=True).samples
    for value, degrees in ((2.0, 35.0), (6.0, 45.0)):
        (index,) = np.flatnonzero(samples.rgb[:, 0] == value)
        wo = samples.wo[index]
        assert math.degrees(to_spherical(split(samples.wi[index]))[0]) == pytest.approx(40.0)
        assert math.degrees(to_spherical(split(wo))[0]) == pytest.approx(degrees)
        assert wo[0] * samples.wi[index][0] < 0.0
        assert wo[1] == pytest.approx(0.0, abs=1e-12)
    (side,) = np.flatnonzero(samples.rgb[:, 0] == 4.0)
    mirror = samples.wi[side] * [-1.0, -1.0, 1.0]
    assert math.degrees(math.acos(samples.wo[side] @ mirror)) == pytest.approx(5.0)
    assert abs(samples.wo[side][1]) == pytest.approx(math.sin(math.radians(5.0)))


def test_zemax_total_scatter_is_the_albedo(tmp_path: Path) -> None:
    path = tmp_path / "gray.zemax.bsdf"
    nacre.save(Glossy((0.4,) * 3), path)
    text = path.read_text()
    assert "SpectralContent  Monochrome" in text
    found = [float(line.split()[1]) for line in text.splitlines() if line.startswith("TIS")]
    angles = np.radians(np.linspace(0.0, 85.0, 18))
    expected = albedos(Glossy((0.4,) * 3), np.stack([angles, 0.0 * angles]), 32)[:, 0]
    # It is that of the table, not of the material, so that nothing is scaled when it is read.
    np.testing.assert_allclose(found[:-2], np.minimum(expected, 1.0)[:-2], atol=5e-3)
    nacre.save(Glossy((3.0, 2.0, 1.0)), path.with_name("bright.zemax.bsdf"))
    lines = path.with_name("bright.zemax.bsdf").read_text().splitlines()
    assert max(float(line.split()[1]) for line in lines if line.startswith("TIS")) == 1.0


def test_speos_percentages_make_the_values_f_r(tmp_path: Path) -> None:
    """The same table at another scale, or times the cosine, is the same material."""
    path, other = tmp_path / "a.brdf", tmp_path / "b.brdf"
    writer(path, (3, 30, 8))(Glossy((0.5,) * 3), path)
    lines = path.read_text().splitlines()
    start = 10
    scaled = [*lines[:6], "0", *lines[7:start]]
    for line in lines[start:]:
        cells = line.split("\t")
        if len(cells) == 16 and cells[0]:
            cosine = math.cos(math.radians(float(cells[0])))
            scaled.append(
                "\t".join([cells[0], *(f"{7 * cosine * float(x):.7g}" for x in cells[1:])])
            )
        else:
            scaled.append(line)
    other.write_text("\n".join(scaled) + "\n")
    one, two = nacre.load(path).samples, nacre.load(other).samples
    inside = one.wo[:, 2] > 0.01
    np.testing.assert_allclose(two.rgb[inside], one.rgb[inside], rtol=2e-3)
    (percent, *_) = (float(line) for line in lines[start:] if "\t" not in line)
    assert percent == pytest.approx(
        100.0 * albedos(Glossy((0.5,) * 3), np.zeros((2, 1)), 32)[0, 0], rel=0.01
    )


def test_the_mirror_direction_of_speos_has_azimuth_0(tmp_path: Path) -> None:
    path = tmp_path / "paint.brdf"
    path.write_bytes(SPECIMENS["Speos BSDF"].files()[0])
    samples = nacre.load(path).samples
    bright = samples.rgb[:, 0].argmax()
    assert samples.wi[bright][0] * samples.wo[bright][0] < 0.0


def test_openmaterial_files_are_valid_by_the_schema(tmp_path: Path) -> None:
    """By another reader of schemas; the published constraints, copied without their words."""
    jsonschema = pytest.importorskip("jsonschema", reason="needs jsonschema")
    path = tmp_path / "glossy_brdf.xompt"
    writer(path, (3, 5, 4))(Glossy(), path)
    content, schema = (json.loads(file.read_text("utf-8")) for file in (path, SCHEMA))
    jsonschema.validate(content, schema, jsonschema.Draft7Validator)
    table = content["brdf"]["lookupTable"]
    assert table == sorted(table)
    assert sorted({row[0] for row in table}) == content["brdf"]["wavelengths"]
    content["brdf"]["lookupTable"][3][1] = 1.6
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(content, schema, jsonschema.Draft7Validator)


def test_openmaterial_rows_say_where_light_goes(tmp_path: Path) -> None:
    path = tmp_path / "paint_brdf.xompt"
    row = [5.5e-7, 0.7, 0.4, 1.0, 0.25]
    path.write_text(json.dumps({"metadata": {"name": "x"}, "brdf": {"lookupTable": [row]}}))
    brdf = nacre.load(path)
    assert brdf.name == "x"
    np.testing.assert_allclose(brdf.samples.wi[0], join(from_spherical(np.float64(0.7), 0.0)))
    np.testing.assert_allclose(brdf.samples.wo[0], join(from_spherical(np.float64(0.4), 1.0)))
    np.testing.assert_allclose(brdf.samples.rgb, 0.25, rtol=1e-3)
    assert brdf.wavelengths.tolist() == [pytest.approx(550.0)]


def test_a_scan_with_spectra_is_written_as_it_is(tmp_path: Path) -> None:
    path, again = tmp_path / "a_brdf.xompt", tmp_path / "b_brdf.xompt"
    path.write_bytes(SPECIMENS["OpenMATERIAL 3D"].files()[0])
    scan = nacre.load(path)
    openmaterial.save(scan, again)
    back = nacre.load(again)
    np.testing.assert_allclose(back.spectra, scan.spectra)
    np.testing.assert_allclose(back.samples.wi @ [0, 0, 1], scan.samples.wi @ [0, 0, 1], atol=1e-6)
    openmaterial.save(back.replaced(source=scan.source), tmp_path / "c_brdf.xompt")
    assert (tmp_path / "c_brdf.xompt").read_bytes() == again.read_bytes()


def test_spectra_of_colors_have_these_colors() -> None:
    wi, wo = (hemisphere(np.random.default_rng(5), 50) for _ in range(2))
    brdf = Glossy()
    values = specular_nodes.spectra(brdf, wi, wo)
    assert values.shape == (50, 16)
    assert (values >= 0.0).all()
    rgb = nacre.spectra.to_rgb(values, specular_nodes.BANDS)
    np.testing.assert_allclose(rgb, brdf.eval(wi, wo), rtol=2e-3, atol=1e-6)


def test_the_trapezoidal_rule_knows_a_diffuse_table() -> None:
    polars, azimuths = specular_nodes.Resolution(2, 60, 20).views(30.0)
    flat = np.full((len(polars), len(azimuths)), 1.0 / math.pi)
    assert specular_nodes.reflected(flat, polars, azimuths) == pytest.approx(1.0, rel=3e-3)
    assert polars[0] == 0.0
    assert polars[-1] == 90.0
    assert 30.0 in polars
    assert (np.diff(polars) > 0.0).all()


@pytest.mark.parametrize(
    ("name", "old", "new", "words"),
    [
        ("Zemax BSDF", b"ScatterType  BRDF", b"ScatterType  BTDF", "only reflection"),
        ("Zemax BSDF", b"Rotation  1\n0", b"Rotation  2\n0 90", "'DataEnd', expected TIS"),
        ("Zemax BSDF", b"PlaneSymmetrical", b"Radial", "symmetry: 'radial', expected"),
        ("Zemax BSDF", b"0\t90\t180", b"0\t90\t360", "scatterazimuth: must increase"),
        ("Zemax BSDF", b"TIS 0.2", b"0.2", "expected TIS"),
        ("Zemax BSDF", b"DataEnd\n", b"", "cut short"),
        ("Speos BSDF", b"v9.0\n0\n", b"v9.0\n1\n", "in binary mode"),
        ("Speos BSDF", b"v9.0", b"v4.0", "version 4 has another layout"),
        ("Speos BSDF", b"1\t0\n1\n", b"0\t1\n1\n", "transmission"),
        ("Speos BSDF", b"\n11\n", b"\n11x\n", "line 4"),
        (
            "Speos BSDF",
            b"2\t3\n\t0\t90\t180",
            b"2\t3\n\t0\t90\t190",
            "after the last table|other angles|must increase",
        ),
        ("OpenMATERIAL 3D", b"lookupTable", b"table", "lookupTable: missing"),
        ("OpenMATERIAL 3D", b"[4.5e-07, 0.2, 0.2", b"[4.5e-07, 0.25, 0.2", "other directions"),
        ("OpenMATERIAL 3D", b"[4.5e-07, 0.2", b"[4.5e-07, 1.9", "incidence 1.9, expected 0 to"),
        ("OpenMATERIAL 3D", b"[4.5e-07, 0.2, ", b"[4.5e-07, ", "row 0: expected 5 numbers"),
        (
            "OpenMATERIAL 3D",
            b"[4.5e-07, 0.2, 0.2",
            b'[4.5e-07, "a", 0.2',
            "expected finite numbers",
        ),
    ],
)
def test_what_is_not_read_is_refused_by_name(
    tmp_path: Path, name: str, old: bytes, new: bytes, words: str
) -> None:
    specimen = SPECIMENS[name]
    content = specimen.files()[0]
    assert old in content
    path = tmp_path / specimen.name
    path.write_bytes(content.replace(old, new, 1))
    with pytest.raises(FormatError, match=words):
        nacre.load(path)


def test_anisotropic_materials_and_other_bands_are_refused(tmp_path: Path) -> None:
    from nacre.formats import check_target

    class Turned(Glossy):
        isotropic = False

    for ending in ENDINGS[1:]:
        with pytest.raises(FormatError, match="isotropic reflectance only"):
            check_target(tmp_path / f"x{ending}", Turned())
    with pytest.raises(FormatError, match="incidences are 2 to 90"):
        writer(tmp_path / "x.brdf", (1, 5, 5))


def test_a_zemax_table_ends_with_its_word(tmp_path: Path) -> None:
    content = SPECIMENS["Zemax BSDF"].files()[0]
    path = tmp_path / "a.bsdf"
    path.write_bytes(content.replace(b"DataEnd", b"dataEND"))
    nacre.load(path)
    path.write_bytes(content.replace(b"DataEnd", b"0.25"))
    with pytest.raises(FormatError, match=r"'0\.25', expected DataEnd"):
        nacre.load(path)


def test_openmaterial_files_name_their_schema_and_what_the_standard_asks_for(
    tmp_path: Path,
) -> None:
    path = tmp_path / "glossy_brdf.xompt"
    writer(path, (3, 5, 4))(Glossy(), path)
    content = json.loads(path.read_text("utf-8"))
    place = "https://raw.githubusercontent.com/asam-ev/OpenMATERIAL-3D/refs/tags/v1.1.0/schemas"
    assert content["$schema"] == f"{place}/material_brdf_schema.json"
    metadata = content["metadata"]
    assert metadata["name"] == "glossy"
    assert metadata["openMaterial3dVersion"] == "1.1.0"
    assert metadata["sources"] == "tabulated by nacre from made"


@pytest.mark.parametrize(
    ("name", "old", "new", "fine"),
    [
        ("Speos BSDF", b"10 40", b"10 90.0009", True),
        ("Speos BSDF", b"10 40", b"10 90.002", False),
        ("Speos BSDF", b"10 40", b"10 10", False),
        ("Speos BSDF", b"10 40", b"-1 40", False),
        ("Speos BSDF", b"80\t0.3", b"90.002\t0.3", False),
        ("Zemax BSDF", b"0\t90\t180", b"0\t90\t180.0009", True),
        ("Zemax BSDF", b"0\t90\t180", b"0\t90\t180.002", False),
        ("Zemax BSDF", b"10\t40", b"10\t90.002", False),
    ],
)
def test_angles_end_where_they_may(
    tmp_path: Path, name: str, old: bytes, new: bytes, fine: bool
) -> None:
    """A thousandth of a degree is left to rounding."""
    content = SPECIMENS[name].files()[0]
    old, new = (part if part in content else part.replace(b" ", b"\t") for part in (old, new))
    assert old in content
    path = tmp_path / SPECIMENS[name].name
    path.write_bytes(content.replace(old, new.replace(b" ", b"\t")))
    if fine:
        nacre.load(path)
    else:
        with pytest.raises(FormatError, match=r"must increase from 0 to up to|polar angles"):
            nacre.load(path)


class Fine(Glossy):
    """More bands than a table takes; f_r bends with the wavelength."""

    wavelengths = np.linspace(390.0, 720.0, 60)

    def eval_bands(self, wi, wo):
        return np.tile(0.1 + (self.wavelengths / 1000.0) ** 3, (len(wi), 1))


def test_many_bands_become_the_usual_ones_on_straight_lines() -> None:
    wi, wo = (hemisphere(np.random.default_rng(6), 4) for _ in range(2))
    brdf = Fine()
    expected = np.interp(
        specular_nodes.BANDS, brdf.wavelengths, 0.1 + (brdf.wavelengths / 1000.0) ** 3
    )
    found = specular_nodes.spectra(brdf, wi, wo)
    np.testing.assert_allclose(found, np.tile(expected, (4, 1)), rtol=1e-6)
