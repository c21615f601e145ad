"""Closure mixtures in Cycles beside what they were fitted to, on the sphere of the protocol.

    NACRE_BLENDER_PYTHON=... python -m lab.studies.parity.mixture_in_cycles [FILE ...] [--samples N]

Each material becomes a script for Blender, whose Cycles renders the sphere of
:mod:`nacre.mitsuba.sphere` in the museum's light and in the directional light, through the same
points. Beside it are the material itself and the mixture, both as NumPy renders them. Writes a
table of PSNR and a sheet `NAME.png` for each: material, mixture in Cycles, FLIP.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

import nacre
from lab.studies.study import Study, log, museum, rgl_tables
from nacre.array import Weights
from nacre.brdf import Brdf
from nacre.color import tone_map
from nacre.figures.difference_sheet import Row, difference_sheet
from nacre.figures.page import scale_end
from nacre.metrics.metrics import image_errors
from nacre.mitsuba.lights import Light
from nacre.mitsuba.preview import write_bytes
from nacre.mitsuba.sphere import SIZE, render_sphere, standard_lights
from nacre.standard.closures import Closures
from nacre.standard.fitted import fitted
from nacre.targets import TARGETS
from tests.oracles import blender
from tests.oracles.blender_addon import run

DIRECTIONS = 4096
"""That stand for the environment at each point: Cycles has no fixed ones."""

COLUMNS = (
    *("material", "light", "mixture, NumPy: PSNR", "mixture, Cycles: PSNR"),
    "Cycles against NumPy: PSNR, max",
)


def main() -> None:
    """Run the study."""
    study = Study(__doc__, __file__)
    study.add_argument("files", nargs="*", type=Path, help="materials (default: the RGL tables)")
    study.add_argument("--samples", type=int, default=1024, help="of Cycles a pixel")
    options = study.options()
    if missing := blender.missing():
        sys.exit(f"{missing} is not there")
    environment = museum()
    lights = standard_lights(environment, DIRECTIONS)
    rows = []
    for path in study.few(options.files or rgl_tables()):
        brdf = nacre.load(path)
        log(brdf.name)
        mixture = fitted(brdf, Closures)
        found = in_cycles(mixture, environment.exposed().pixels, options.samples)
        sheet = []
        for name, light in lights.items():
            row, cells = compared(brdf, mixture, found[name], light)
            sheet.append(row)
            rows.append([path.stem, name, *cells])
        scale = scale_end([row.error for row in sheet])
        title = f"Difference (FLIP, 0 to {scale:g})"
        titles = "Material", "Closures in Cycles"
        page = difference_sheet(sheet, scale, title, titles=titles)
        write_bytes(page, study.output / f"{path.stem}.png")
    study.table(COLUMNS, rows, note=f"{SIZE} x {SIZE} pixels; {options.samples} samples in Cycles")


def in_cycles(mixture: Closures, pixels: Weights, samples: int) -> dict[str, Weights]:
    """Pictures by the names of lights, linear RGB, shape (SIZE, SIZE, 3)."""
    with tempfile.TemporaryDirectory() as folder:
        script, light = Path(folder, "material.py"), Path(folder, "light.npy")
        (content,) = TARGETS["blender-closures"]().files(mixture, "material").values()
        script.write_bytes(content)
        np.save(light, pixels)
        _, sky = run("sky", script, light, SIZE, samples)
        _, sun = run("script", script, SIZE)
    return {"environment": sky[0], "directional": sun[0]}


def compared(brdf: Brdf, mixture: Closures, found: Weights, light: Light) -> tuple[Row, list[str]]:
    """A row of the sheet, and the cells of the table from the third on."""
    truth, mask = render_sphere(brdf, light)
    ours, _ = render_sphere(mixture, light)
    found = np.where(mask[..., None], found, 0.0)
    (near, _), (far, flips), (apart, _) = (
        image_errors(*pair, mask) for pair in ((truth, ours), (truth, found), (ours, found))
    )
    largest = np.abs(tone_map(found) - tone_map(ours)).max()
    row = Row(truth, found, flips, light.name, f"PSNR {far.psnr:.1f} dB", sphere=True)
    return row, [f"{near.psnr:.1f}", f"{far.psnr:.1f}", f"{apart.psnr:.1f}, {largest:.4f}"]


if __name__ == "__main__":
    main()
