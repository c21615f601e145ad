"""Small tables as optical tools have them: Radiance, OpenMATERIAL 3D, Zemax, Speos."""

from __future__ import annotations

import json
from random import Random
from typing import Any

from tests.specimens.scans import text_rebuilt
from tests.specimens.specimen import NUMBERS, VALUES, Specimen, odd_json

_WORDS = [str(number) for number in (*NUMBERS, *VALUES)]


# Radiance


def _radiance_file(
    value: object = 0.25, rank: int = 3, color: str = "", side: str = "Back"
) -> bytes:
    grid = " ".join(f"{0.01 * n}" for n in range((1 << rank) - 1))
    branches = f"{{{grid} {value}}}" + "{0.1}" * ((1 << rank) - 1)
    data = {"Visible": f"{{{branches}}}"}
    if color:
        data |= {"CIE-u": "{0.2}", "CIE-v": f"{{{color}}}"}
    tables = "".join(
        f"<WavelengthData><Wavelength>{name}</Wavelength><WavelengthDataBlock>"
        f"<WavelengthDataDirection>Reflection {side}</WavelengthDataDirection>"
        f"<AngleBasis>LBNL/Shirley-Chiu</AngleBasis><ScatteringData>{text}</ScatteringData>"
        "</WavelengthDataBlock></WavelengthData>"
        for name, text in data.items()
    )
    structure = f"<IncidentDataStructure>TensorTree{rank}</IncidentDataStructure>"
    return (
        f"<WindowElement><Optical><Layer><Material><Name>paint</Name></Material><DataDefinition>"
        f"{structure}</DataDefinition>{tables}</Layer></Optical></WindowElement>"
    ).encode()


def _radiance_files() -> list[bytes]:
    return [
        _radiance_file(),
        _radiance_file(color="0.4737"),
        _radiance_file(rank=4, color="0.5"),
        _radiance_file(side="Front").replace(b" 0.", b",\n0."),
    ]


_BRACES = ["{", "}", "{}", "{{{{", "nan", "1_0", "٣", "<a>", "</Layer>", "&x;", "<!DOCTYPE a>"]


def _radiance_rebuilt(_: bytes, random: Random) -> bytes:
    """Words and braces of a tree replaced by others."""
    words = (
        random.choice(_radiance_files()).decode().replace("{", " { ").replace("}", " } ").split(" ")
    )
    for _change in range(random.choice((1, 1, 2, 4))):
        words[random.randrange(len(words))] = random.choice(_WORDS + _BRACES)
    return " ".join(words).encode()


# ASAM OpenMATERIAL 3D

_METADATA = {"name": "paint", "openMaterial3dVersion": "1.1.0", "sources": "made"}
_ROWS = ((0.2, 0.2, 3.141593), (0.2, 0.9, 0.0), (0.7, 0.7, 3.0), (0.7, 0.1, 1.0))


def _openmaterial_file(value: Any = 0.25, wavelength: Any = 6.5e-7, phi: Any = 2.0) -> bytes:
    rows: list[list[Any]] = [[4.5e-7, *row, 0.1] for row in (*_ROWS, (1.0, 0.3, 2.0))]
    rows += [[6.5e-7, *row, 0.2] for row in _ROWS] + [[wavelength, 1.0, 0.3, phi, value]]
    brdf = {"wavelengths": [4.5e-7, 6.5e-7], "lookupTable": rows}
    return json.dumps({"metadata": _METADATA, "brdf": brdf}).encode()


def _openmaterial_files() -> list[bytes]:
    whole = json.loads(_openmaterial_file())
    whole["brdf"]["lookupTable"] += [[4.5e-7, 0.1, None, 0.0, 0.3]]
    return [_openmaterial_file(), json.dumps(whole, indent=4).encode()]


def _openmaterial_rebuilt(_: bytes, random: Random) -> bytes:
    """One part of the content replaced by something else."""
    content = json.loads(random.choice(_openmaterial_files()))
    part: Any = content
    while True:
        key = random.choice(list(part) if isinstance(part, dict) else range(len(part)))
        if not isinstance(part[key], dict | list) or not part[key] or random.random() < 0.2:
            break
        part = part[key]
    part[key] = odd_json(random)
    return json.dumps(content).encode()


# Zemax


def _zemax_file(value: Any = 0.25, count: int = 2, content: str = "Monochrome") -> bytes:
    lines = ["# paint", "Source  Measured", "Symmetry  PlaneSymmetrical"]
    lines += [f"SpectralContent  {content}", "ScatterType  BRDF", "SampleRotation  1", "0"]
    lines += [f"AngleOfIncidence  {count}", "10\t40", "ScatterAzimuth  3", "0\t90\t180"]
    lines += ["ScatterRadial  2", "0\t5", ""]
    names = ["Monochrome"] if content == "Monochrome" else [f"Tristimulus{axis}" for axis in "XYZ"]
    for name in names:
        lines += [name, "DataBegin", *(["TIS 0.2", *["0.2\t0.1"] * 3] * 2), "DataEnd"]
    lines[-2] = f"{value}\t0.1"
    return ("\n".join(lines) + "\n").encode()


def _zemax_files() -> list[bytes]:
    whole = _zemax_file()
    return [
        whole,
        _zemax_file(content="XYZ"),
        whole.replace(b"Plane", b"a").replace(b"\n", b"\r\n"),
    ]


# Speos


def _speos_file(value: Any = 0.25, count: int = 2, bands: str = "450\t650") -> bytes:
    lines = ["OPTIS - brdf surface file v9.0", "0", "paint", "11", "a long text", "1\t0", "1"]
    number = len(bands.split())
    lines += [f"{count}\t{number}", "10\t40", bands]
    for _ in range(2 * number):
        lines += ["12.5", "2\t3", "\t0\t90\t180", "0\t0.1\t0.1\t0.1", "80\t0.3\t0.2\t0.1"]
    lines[-1] = f"80\t0.3\t0.2\t{value}"
    return ("\n".join(lines) + "\n").encode()


def _speos_files() -> list[bytes]:
    whole = _speos_file()
    intensities = whole.replace(b"1\t0\n1\n", b"1\t0\n0\n").replace(b"11\na long text", b"0\n")
    return [whole, intensities, _speos_file(bands="550") + b"End of file\n"]


SPECIMENS = {
    "OpenMATERIAL 3D": Specimen(
        "paint_brdf.xompt",
        _openmaterial_files,
        header=100,
        sized=lambda count: [_openmaterial_file(wavelength=count), _openmaterial_file(phi=count)],
        valued=lambda value: [_openmaterial_file(value)],
        rebuild=_openmaterial_rebuilt,
    ),
    "Zemax BSDF": Specimen(
        "paint.bsdf",
        _zemax_files,
        header=100,
        sized=lambda count: [_zemax_file(count=count)],
        valued=lambda value: [_zemax_file(value), _zemax_file(value, content="XYZ")],
        rebuild=text_rebuilt(_zemax_files),
        text=True,
    ),
    "Speos BSDF": Specimen(
        "paint.brdf",
        _speos_files,
        header=100,
        sized=lambda count: [_speos_file(count=count)],
        valued=lambda value: [_speos_file(value)],
        rebuild=text_rebuilt(_speos_files),
        text=True,
    ),
    "Radiance BSDF": Specimen(
        "paint.xml",
        _radiance_files,
        header=100,
        sized=lambda count: [_radiance_file().replace(b"TensorTree3", b"TensorTree%d" % count)],
        valued=lambda value: [_radiance_file(value), _radiance_file(color=str(value))],
        rebuild=_radiance_rebuilt,
    ),
}
