"""The Khronos validator of glTF files, and viewers in web pages: Khronos' own, and three.js."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from nacre.array import Floats
from tests.oracles.runners import browser, three

_PACKAGES = Path(sys.prefix) / "three" / "node_modules"  # by scripts/setup.py
_KHRONOS = _PACKAGES / "@khronosgroup" / "gltf-viewer" / "dist"
_VALIDATOR = _PACKAGES / "gltf-validator"
_GAMMA = 2.2  # of what the sample viewer draws where it maps no tones

Viewer = Literal["khronos", "three"]

NO_COMPENSATION = (
    "lights_physical_pars_fragment",
    "specularBRDF * material.multiScatteringCompensation",
    "specularBRDF",
)
"""Takes from three.js the light that it adds for facets that light meets several times."""

AS_WRITTEN = (
    (
        "info.clearcoatF0=vec3(pow((info.ior-1.0)/(info.ior+1.0),2.0));",
        "info.clearcoatF0=vec3(0.04);",
    ),
    ("float v=0.5/(GGXV+GGXL);return clamp(v,0.0,1.0);", "return 0.5/(GGXV+GGXL);"),
    (
        "materialInfo.iridescenceThickness,materialInfo.f0_dielectric)",
        "materialInfo.iridescenceThickness,materialInfo.f0_dielectric*materialInfo.specularWeight)",
    ),
)
"""Gives the sample viewer what the texts of the extensions have where it differs: a coat of index
1.5, whatever is below; the specular factor in the film's base; and from anisotropic facets it takes
a bound that isotropic ones have not.
"""


def missing() -> str | None:
    """What viewers need and this machine does not have."""
    return three.missing() or (
        None if _KHRONOS.is_dir() else "npm's @khronosgroup/gltf-viewer (make tools)"
    )


def missing_validator() -> str | None:
    """What the validator needs and this machine does not have."""
    if not _VALIDATOR.is_dir():
        return "npm's gltf-validator (make tools)"
    return None if shutil.which("node") else "node"


def drawn(
    viewer: Viewer,
    scenes: Sequence[bytes],
    size: tuple[int, int],
    sheen_albedo: Floats | None = None,
    edits: Sequence[tuple[str, ...]] = (),
) -> Floats:
    """Linear values of pictures, rows from the top, shape (scenes, height, width, 3).

    Parameters
    ----------
    viewer
        Which one.
    scenes
        Files (`.glb`) with a camera and lights each.
    size
        Width and height in pixels.
    sheen_albedo
        For the sample viewer: the table that comes with its page, not with its package, of shape
        (n, n): over the roughness, then over the cosine, at the centers of pixels.
    edits
        Of the shaders: what stands in them and what shall; of three.js', also the chunk before.
    """
    width, height = size
    files: dict[str, bytes | Path] = {**three.page(), **browser.scripts("gltf.js")}
    files["khronos"] = _KHRONOS
    files |= {f"scene-{place}.glb": scene for place, scene in enumerate(scenes)}
    table = np.zeros((2, 2)) if sheen_albedo is None else sheen_albedo
    argument = {"count": len(scenes), "width": width, "height": height, "edits": edits}
    found = browser.floats(
        browser.compute(files, "gltf.js", viewer, argument, {"sheen": table.astype(np.float32)})
    )
    values = found.reshape(len(scenes), height, width, 4)[..., :3].astype(np.float64)
    return values[:, ::-1] ** _GAMMA if viewer == "khronos" else values


def validate(files: Sequence[Path]) -> list[dict[str, Any]]:
    """What the Khronos validator says of each file: "issues" and "info"."""
    script = (
        "const validator = require(process.argv[1]);"
        "const files = process.argv.slice(2);"
        "const read = (file) => new Uint8Array(require('fs').readFileSync(file));"
        "Promise.all(files.map((file) => validator.validateBytes(read(file))))"
        ".then((reports) => console.log(JSON.stringify(reports)));"
    )
    with tempfile.TemporaryDirectory() as folder:
        command = ["node", "-e", script, str(_VALIDATOR), *(str(file.resolve()) for file in files)]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    reports: list[dict[str, Any]] = json.loads(done.stdout)
    return reports
