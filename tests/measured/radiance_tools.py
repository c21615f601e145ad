"""Radiance's own programs, from the wheel of pyradiance."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

pyradiance = pytest.importorskip("pyradiance", reason="needs pyradiance")
_HOME = Path(pyradiance.__file__).parent


_LIBRARY = """
import json, sys
from pyradiance import bsdf
data = bsdf.load_file(sys.argv[1])
queries = json.load(sys.stdin)
found = [
    bsdf.query(data, *query)[1]
    if len(query) == 4
    else bsdf.direct_hemi(data, *query, 0.0, bsdf.SAMPLE_ALL)
    for query in queries
]
print(json.dumps(found))
"""


def _asked(path: Path, queries: list[tuple[float, ...]]) -> npt.NDArray[np.float64]:
    """What Radiance's library says, in a process of its own: it may crash on a second file."""
    done = subprocess.run(
        [sys.executable, "-c", _LIBRARY, str(path)],
        input=json.dumps(queries).encode(),
        capture_output=True,
        check=True,
        timeout=60,
    )
    return np.array(json.loads(done.stdout))


def luminances(
    path: Path, incident: npt.NDArray[np.floating], other: npt.NDArray[np.floating]
) -> npt.NDArray[np.float64]:
    """f_r as Radiance's library reads it out of a file: its Y, shape (n,)."""
    pairs = zip(incident, other, strict=True)
    return _asked(path, [(*_degrees(a), *_degrees(b)) for a, b in pairs])


def hemispherical(path: Path, theta: list[float]) -> npt.NDArray[np.float64]:
    """Fractions of the light that are reflected, by polar angles in radians."""
    return _asked(path, [(math.degrees(angle),) for angle in theta])


def rendered(
    path: Path, wi: npt.NDArray[np.floating], wo: npt.NDArray[np.floating], folder: Path
) -> npt.NDArray[np.float64]:
    """Radiance of a polygon under a small sun of unit irradiance, RGB of shape (n, 3).

    The polygon faces +z and has the file as its BSDF material, with y up.
    """
    angle = 0.01
    solid = 2.0 * math.pi * (1.0 - math.cos(math.radians(0.5 * angle)))
    found = []
    for light, view in zip(wi, wo, strict=True):
        level = 1.0 / (solid * light[2])
        scene = (
            f"void light bright 0 0 3 {level} {level} {level}\n"
            f"bright source sun 0 0 4 {light[0]} {light[1]} {light[2]} {angle}\n"
            f"void BSDF paint 6 0 {path.name} 0 1 0 . 0 0\n"
            "paint polygon ground 0 0 12 -1 -1 0 1 -1 0 1 1 0 -1 1 0\n"
        )
        (folder / "scene.rad").write_text(scene)
        (folder / "scene.oct").write_bytes(_run(folder, "oconv", "scene.rad"))
        options = ("-h", "-w-", "-ab", "0", "-dj", "0", "-dt", "0", "-dc", "1", "-ss", "0")
        ray = " ".join(map(str, (*view, *-view)))
        found.append(
            [float(x) for x in _run(folder, "rtrace", *options, "scene.oct", ray=ray).split()]
        )
    return np.array(found)


def _run(folder: Path, program: str, *arguments: str, ray: str = "") -> bytes:
    environment = os.environ | {"RAYPATH": f".:{_HOME / 'lib'}"}
    done = subprocess.run(
        [_HOME / "bin" / program, *arguments],
        cwd=folder,
        env=environment,
        input=ray.encode(),
        capture_output=True,
        check=True,
        timeout=60,
    )
    return done.stdout


def _degrees(w: npt.NDArray[np.floating]) -> tuple[float, float]:
    return math.degrees(math.acos(w[2])), math.degrees(math.atan2(w[1], w[0]))
