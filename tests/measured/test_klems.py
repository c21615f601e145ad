"""Klems matrices in WINDOW's files, against Radiance's own library."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.errors import FormatError
from nacre.measured.klems import BASES
from tests.data import require_data


def document(
    basis: str,
    matrix: np.ndarray,
    *,
    rows: bool = False,
    define: bool = True,
    between: str = ",",
) -> str:
    known = BASES[basis]
    rings = "".join(
        f"<AngleBasisBlock><Theta>0</Theta><nPhis>{count}</nPhis><ThetaBounds>"
        f"<LowerTheta>{low}</LowerTheta><UpperTheta>{high}</UpperTheta></ThetaBounds></AngleBasisBlock>"
        for low, high, count in zip(known.bounds, known.bounds[1:], known.counts, strict=False)
    )
    defined = f"<AngleBasis><AngleBasisName>{basis}</AngleBasisName>{rings}</AngleBasis>"
    text = (between + "\n").join(between.join(f"{v:.6g}" for v in row) for row in matrix)
    return (
        '<?xml version="1.0"?><WindowElement xmlns="http://windows.lbl.gov"><Optical><Layer>'
        "<Material><Name>blind</Name><Manufacturer>m</Manufacturer></Material><DataDefinition>"
        f"<IncidentDataStructure>{'Rows' if rows else 'Columns'}</IncidentDataStructure>"
        f"{defined if define else ''}</DataDefinition><WavelengthData>"
        '<Wavelength unit="Integral">Visible</Wavelength><WavelengthDataBlock>'
        "<WavelengthDataDirection>Reflection Back</WavelengthDataDirection>"
        f"<ColumnAngleBasis>{basis}</ColumnAngleBasis><RowAngleBasis>{basis}</RowAngleBasis>"
        f"<ScatteringData>{text}</ScatteringData></WavelengthDataBlock></WavelengthData>"
        "</Layer></Optical></WindowElement>"
    )


def directions(count: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    z, phi = rng.uniform(0.03, 1.0, count), rng.uniform(0.0, 2.0 * math.pi, count)
    r = np.sqrt(1.0 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], -1)


@pytest.mark.parametrize("basis", list(BASES))
@pytest.mark.parametrize("rows", [False, True])
def test_values_are_those_of_radiance(tmp_path: Path, basis: str, rows: bool) -> None:
    tools = pytest.importorskip("tests.measured.radiance_tools")
    count = BASES[basis].patches
    matrix = np.random.default_rng(count).uniform(0.01, 0.2, (count, count))
    path = tmp_path / "blind.xml"
    path.write_text(document(basis, matrix, rows=rows))
    wi, wo = directions(300, 1), directions(300, 2)
    found = nacre.load(path).eval(wi, wo)[:, 1]
    np.testing.assert_allclose(found, tools.luminances(path, wo, wi), rtol=1e-3)


def test_the_real_file_is_read_as_radiance_reads_it() -> None:
    tools = pytest.importorskip("tests.measured.radiance_tools")
    path = require_data("field", "klems", "2011-SA1.XML")
    material = nacre.load(path)
    wi, wo = directions(400, 3), directions(400, 4)
    np.testing.assert_allclose(
        material.eval(wi, wo)[:, 1], tools.luminances(path, wo, wi), rtol=1e-3
    )
    (note,) = material.notes
    for part in ("Transmission Front", "Transmission Back", "Reflection Front", "Solar"):
        assert part in note
    # A second reading, of the text alone: light and viewer at the normal are the first patch.
    text = path.read_text(encoding="utf-8")
    block = re.search(
        r"Visible</Wavelength>(?:(?!<WavelengthData>).)*Reflection Back.*?<ScatteringData>(.*?)<",
        text, re.S,
    )  # fmt: skip
    assert block
    first = float(block[1].split(",")[0])
    assert material.eval([0, 0, 1], [0, 0, 1])[1] == pytest.approx(first, rel=1e-5)


def test_what_holds_transmission_alone_is_refused() -> None:
    path = require_data("field", "klems", "2011-SA1-Small-TabSeparated.XML")
    with pytest.raises(FormatError, match="holds no reflection, but Transmission Back"):
        nacre.load(path)


@pytest.mark.parametrize("between", [",", "\t", " ", ", "])
@pytest.mark.parametrize("define", [True, False])
def test_separators_leading_lines_and_undefined_bases(
    tmp_path: Path, between: str, define: bool
) -> None:
    text = document("LBNL/Klems Quarter", np.full((41, 41), 0.2), between=between, define=define)
    path = tmp_path / "a.XML"
    path.write_text(f"Recover using: genBSDF -recover FILE\n\n{text}")
    material = nacre.load(path)
    assert material.eval([0.6, 0, 0.8], [0, 0.6, 0.8]) == pytest.approx([0.2] * 3)
    assert material.name == "blind"
    assert material.notes == ()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("Columns", "Diagonals", "IncidentDataStructure: 'diagonals'; expected tensortree3"),
        ("0.2", "x", "'x"),
        ("0.2,", "", "values (41 x 41 patches)"),
        ("<ColumnAngleBasis>LBNL/Klems Quarter", "<ColumnAngleBasis>Mine", "'Mine' is not defined"),
        ("<nPhis>8", "<nPhis>-8", "1 to 1024 patches"),
        ("<LowerTheta>9", "<LowerTheta>10", "without a gap"),
        ("<UpperTheta>90", "<UpperTheta>80", "from 0 to 90"),
        ("Visible", "Solar", "no reflection of visible light, but of solar"),
        ("Reflection Back", "Transmission Back", "holds no reflection"),
    ],
)
def test_bad_matrices_are_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    text = document("LBNL/Klems Quarter", np.full((41, 41), 0.2))
    path = tmp_path / "bad.xml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(FormatError) as caught:
        nacre.load(path)
    assert words in str(caught.value)
