"""Small tables of goniometers and of further optical tools: BiRD, Speos, FRED, LightTools, SSDD,
TracePro, pab-opto.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

import nacre
from nacre.analytic import Ggx
from tests.measured.support import tensor_bytes
from tests.specimens.scans import text_rebuilt
from tests.specimens.specimen import Array, Specimen, odd_array

_PLAIN = Ggx(name="paint", diffuse=(0.2,) * 3, specular=(0.05,) * 3, roughness=0.4)


@cache
def _written(ending: str) -> bytes:
    """A small file by the format's own writer, which tests hold against real files."""
    entry = nacre.formats.target(f"a{ending}")
    assert entry.resolution is not None
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"paint{ending}"
        nacre.save(_PLAIN, path, resolution=entry.resolution(3, 4, 5))
        return path.read_bytes()


def _replaced_number(text: bytes, value: Any) -> bytes:
    """The last word of the file that is a number, and is neither an angle nor a count."""
    head, _, last = text.rstrip().rpartition(b"\n")
    words = last.split(b" ") if b"\t" not in last else last.split(b"\t")
    mark = b" " if b"\t" not in last else b"\t"
    words[-1] = str(value).encode()
    return head + b"\n" + mark.join(words) + b"\n"


# BiRD


def _bird(value: Any = 0.2, spread: Any = 0.01) -> bytes:
    lists: dict[str, Any] = {
        "theta_i": ("deg", [30, 30, 60, 60]),
        "phi_i": ("deg", [0] * 4),
        "theta_r": ("deg", [10, 20, 10, 20]),
        "phi_r": ("deg", [180] * 4),
        "BRDF": ("1/sr", [0.1, 0.2, 0.3, value]),
        "uBRDF": ("1/sr", [0.01, 0.01, 0.01, spread]),
    }
    data = {name: {"unit": unit, "values": values} for name, (unit, values) in lists.items()}
    schema = {"$schema": "brdf_json_schema_v1.0.json"}
    sample = {"sample": {"name": "paint"}}
    return json.dumps({**schema, "metadata": sample, "data": data}, indent=1).encode()


# TracePro, pab-opto

_TRACEPRO_LIGHT = "Temperature\tWavelength\tIncAngle\tAziAngle"


def _tracepro_file(value: Any = 0.3, *, model: bool = False) -> bytes:
    lines = ["TracePro Surface Property Data", "TracePro Release: 7 0 0", "", "Name\tpaint"]
    lines += [f"{_TRACEPRO_LIGHT}\tRefl_S\tRefl_P\tBRDF_A\tBRDF_B\tBRDF_g"]
    lines += [f"300\t0.55\t30\t0\t0\t0\t{value if model else 0}\t0.1\t1.5"]
    if not model:
        lines += ["Table_BSDF_Data", f"{_TRACEPRO_LIGHT}\tScatterBeta\tScatterAzimuth\tBRDF\tBTDF"]
        for beta, f in ((0, 0.5), (0.2, 0.4), (0.4, value)):
            lines += [f"300\t0.55\t30\t0\t{beta}\t{turn}\t{f}\t0" for turn in (0, 120, 240)]
    return ("\n".join([*lines, "SAVE-DATA"]) + "\n").encode()


def _pab_file(value: Any = 0.2, light: Any = 30) -> bytes:
    lines = ['#sample_name "paint"', "#format: theta phi DSF", f"#incident_angle {light} 180"]
    lines += [f"{theta}\t{phi}\t0.1" for theta in (0, 20, 40) for phi in range(0, 360, 60)]
    return ("\r\n".join([*lines, f"60\t0\t{value}"]) + "\r\n").encode()


# LightTools, SSDD


def _lighttools_file(value: Any = 0.9, count: Any = 4) -> bytes:
    lines = ["# LightTools", "Symmetry Asymmetric", "SpectralContent Monochrome"]
    lines += [f"ScatterAzimuth {count}", "0 90 180 270", "ScatterRadial 2", "0 30", "DataBegin"]
    lines += ["AOI 30 POI 0 Side Front Wavelength 550 ScatterType BRDF TIS 0.4"]
    lines += ["0.1 0.2 0.1 0.3 0.1 0.2 0.1 " + str(value), "DataEnd"]
    return ("\n".join(lines) + "\n").encode()


def _ssdd_file(value: Any = 0.3, mode: str = "ascii") -> bytes:
    lines = ["VERSION 0.2", "DATA_TYPE brdf", "COLOR_MODEL rgb", "NAME blue"]
    lines += ["PARAM_TYPE half_difference_coordinate_system", "REDUCTION_TYPE bilateral_symmetry"]
    lines += ["PARAM0_LIST 0 30", "PARAM2_LIST 0 20 40", "PARAM3_LIST 0 90", f"DATA {mode}"]
    values = np.full((12, 3), 0.2)
    head = ("\n".join(lines) + "\n").encode()
    if mode == "binary":
        return head + values.astype("<f4").tobytes()
    return head + b"0.2 0.2 0.2\n" * 11 + f"0.1 0.2 {value}\n".encode()


# Tables of goniometers


def _table(value: Any = 0.1, band: Any = 650) -> bytes:
    rows = ["Probe 3", "theta_in;theta_out;phi;wavelength;BRDF"]
    rows += [f"10;{out};180;{wl};0.2" for out in (20, 30, 60) for wl in (450, 650)]
    rows += ["40;20;180;450;0.3", f"40;20;180;{band};{value}"]
    return ("\n".join(rows) + "\n").encode()


def _tables() -> list[bytes]:
    whole = _table()
    plane = b"inc,view,brdf\n" + b"".join(b"10,%d,0.2\n" % view for view in range(-60, 61, 20))
    return [whole, whole.replace(b";", b"\t"), whole.replace(b".", b","), plane]


# Polarized


def _polarized_fields() -> dict[str, Array]:
    tensors: dict[str, Array] = {
        "phi_d": np.linspace(-np.pi, np.pi, 5, dtype=np.float32)[None],
        "theta_d": np.linspace(0.0, 0.5 * np.pi, 3, dtype=np.float32)[None],
        "theta_h": np.linspace(0.0, 0.5 * np.pi, 3, dtype=np.float32)[None],
        "wvls": np.array([450, 550, 650], np.uint16),
    }
    tensors["M"] = np.full((5, 3, 3, 3, 4, 4), 0.2, np.float32)
    return tensors


def _polarized(name: str = "M", array: Array | None = None) -> bytes:
    return tensor_bytes(_polarized_fields() | ({} if array is None else {name: array}))


def _polarized_valued(value: float) -> list[bytes]:
    made = []
    for name in ("phi_d", "theta_d", "theta_h"):
        array = _polarized_fields()[name].copy()
        array[0, 1] = value
        made.append(_polarized(name, array))
    return made if not -3.0 <= value <= 3.0 else []


def _polarized_rebuilt(_: bytes, random: Random) -> bytes:
    name = random.choice(list(_polarized_fields()))
    array = _polarized_fields()[name]
    shape = array.shape if random.random() < 0.7 else array.shape[:-1]
    return _polarized(name, odd_array(random, shape, array.dtype.str))


# ASAM OpenMATERIAL 3D, a material beside its table


def _material(name: str = "paint_brdf.xompt") -> bytes:
    return (
        '{"metadata": {"name": "paint"}, "materialProperties": {"densityData": {"density": 2.0}, '
        f'"brdfUris": ["{name}"]}}}}'
    ).encode()


def _companion() -> bytes:
    rows = [[6.5e-7, 0.2, 0.1 * k, 3.0, 0.2] for k in range(1, 6)]
    return (
        '{"metadata": {"name": "paint"}, "brdf": {"wavelengths": [6.5e-07], "lookupTable": '
        f"{rows}}}}}"
    ).encode()


def _text(
    name: str,
    files: Callable[[], list[bytes]],
    valued: Callable[[float], list[bytes]],
    sized: Callable[[int], list[bytes]] = lambda count: [],
    **more: Any,
) -> Specimen:
    return Specimen(
        name, files, header=100, sized=sized, valued=valued, rebuild=text_rebuilt(files), text=True,
        **more,
    )  # fmt: skip


SPECIMENS = {
    "polarized BRDF": Specimen(
        "paint.pbsdf",
        lambda: [_polarized()],
        header=100,
        sized=lambda count: [],
        valued=_polarized_valued,
        rebuild=_polarized_rebuilt,
    ),
    "universal BRDF file (BiRD)": Specimen(
        "paint.brdf",
        lambda: [_bird()],
        header=100,
        sized=lambda count: [],
        valued=lambda value: [_bird(value), _bird(spread=value)],
        rebuild=text_rebuilt(lambda: [_bird()]),
    ),
    "Speos anisotropic BSDF": _text(
        "paint.anisotropicbsdf",
        lambda: [_written(".anisotropicbsdf")],
        valued=lambda value: [_replaced_number(_written(".anisotropicbsdf"), value)],
    ),
    "FRED scatter": _text(
        "paint.fred.txt",
        lambda: [_written(".fred.txt")],
        valued=lambda value: [_replaced_number(_written(".fred.txt"), value)],
    ),
    "TracePro surface property": _text(
        "paint.txt",
        lambda: [_tracepro_file(), _tracepro_file(model=True)],
        valued=lambda value: [_tracepro_file(value)],
    ),
    "pab-opto scan": _text(
        "paint.txt",
        lambda: [_pab_file()],
        valued=lambda value: [_pab_file(value), _pab_file(light=value)],
    ),
    "LightTools BSDF": _text(
        "paint.bsdf",
        lambda: [_lighttools_file()],
        valued=lambda value: [_lighttools_file(value)],
        sized=lambda count: [_lighttools_file(count=count)],
    ),
    "SSDD": _text(
        "paint.ssdd",
        lambda: [_ssdd_file(), _ssdd_file(mode="binary")],
        valued=lambda value: [_ssdd_file(value)],
    ),
    "table of a goniometer": _text(
        "paint.txt",
        _tables,
        valued=lambda value: [_table(value)],
        sized=lambda count: [_table(band=count)],
    ),
    "OpenMATERIAL 3D material": Specimen(
        "paint.xomp",
        lambda: [_material()],
        header=100,
        sized=lambda count: [_material(f"other{count}.xompt")],
        valued=lambda value: [],
        rebuild=text_rebuilt(lambda: [_material().replace(b", ", b",\n")]),
        companions={"paint_brdf.xompt": _companion()},
    ),
}
