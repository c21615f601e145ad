"""MERL to RGL to Mitsuba's `measured`: does a converted table render like its source?

For each material: the published NBRDF network is tabulated as a MERL `.binary` (no measurement,
but a table of the format), `nacre convert` makes an RGL `.bsdf` of that, and Mitsuba's own plugin
`measured` renders it. The source is the MERL table in nacre's plugin `brdf`: same scene (a ball on
a floor under the environment), same number of samples. Columns of the printed table:

- PSNR and FLIP of one rendering of each, tone mapped, over the whole picture;
- the same of two renderings of the source that differ in their seed: what noise alone does;
- PSNR without the noise: the mean product of the differences of two independent pairs of
  renderings, in place of the mean square of one (noise averages out of it), with the bound that
  two standard errors leave where the estimate is not above them;
- PSNR and FLIP of the deterministic sphere (:mod:`nacre.mitsuba.sphere`, no noise) under the
  environment and under the directional light, both tables read by nacre;
- size of the `.bsdf`, and seconds that `nacre convert` took.

The contact sheet shows source | written | FLIP error, the latter on a scale from 0 to 0.1.

Run `python -m lab.studies.ablations.rgl_round_trip FOLDER`; FOLDER holds the published networks of
MERL materials (`chrome.h5`, ...).
"""

from __future__ import annotations

import math
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import numpy.typing as npt

import nacre
from lab.studies.study import TABULATED, Study, log
from nacre.color import tone_map
from nacre.figures.page import Bytes, Page, magma
from nacre.metrics import compare
from nacre.metrics.metrics import image_errors
from nacre.mitsuba.preview import render_preview, write_bytes

FLIP_SCALE = 0.1
COLUMNS = 2
"""Materials side by side on the contact sheet."""

Cells = list[npt.NDArray[np.floating]]


def without_noise(first: npt.NDArray[np.floating], second: npt.NDArray[np.floating]) -> str:
    """PSNR that two independent noisy differences of the same pictures share."""
    product = (first * second).mean(axis=-1)
    mean, error = float(product.mean()), float(product.std() / product.size**0.5)
    if mean > 2.0 * error:
        return f"{-10.0 * math.log10(mean):.1f} dB"
    return f"over {-10.0 * math.log10(max(mean, 0.0) + 2.0 * error):.1f} dB"


def round_trip(network: Path, folder: Path, size: int, spp: int) -> tuple[tuple[str, ...], Cells]:
    """One line of the table, and the three pictures of the contact sheet."""
    table, written = folder / f"{network.stem}.binary", folder / f"{network.stem}.bsdf"
    nacre.save(nacre.load(network), table)
    start = time.perf_counter()
    command = [sys.executable, "-m", "nacre", "convert", str(table), str(written)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    seconds = time.perf_counter() - start

    source = nacre.load(table)
    measured = {"type": "measured", "filename": str(written)}
    pictures = [
        render_preview(material, size=size, spp=spp, seed=seed, denoise=False)
        for seed, material in enumerate((source, source, measured, measured))
    ]
    errors, flip_map = image_errors(pictures[0], pictures[2])
    noise, _ = image_errors(pictures[0], pictures[1])
    shown = [tone_map(picture).astype(np.float64) for picture in pictures]
    spheres = compare(source, nacre.load(written)).lights
    line = (
        network.stem,
        f"{errors.psnr:.1f} dB",
        f"{errors.flip:.4f}",
        f"{noise.psnr:.1f} dB",
        f"{noise.flip:.4f}",
        without_noise(shown[2] - shown[0], shown[3] - shown[1]),
        *(f"{light.errors.psnr:.1f} dB, {light.errors.flip:.4f}" for light in spheres),
        f"{written.stat().st_size / 1e6:.1f} MB",
        f"{seconds:.1f} s",
    )
    return line, [shown[0], shown[2], magma(flip_map / FLIP_SCALE)]


def sheet(names: list[str], rows: list[Cells]) -> Bytes:
    """The contact sheet as bytes of display."""
    edge, gap, label = 1.25, 0.05, 0.25
    width, height = 3 * edge + 6 * gap, edge + label
    page = Page(COLUMNS * width + gap, -(-len(rows) // COLUMNS) * height + gap)
    for index, (name, cells) in enumerate(zip(names, rows, strict=True)):
        x, y = index % COLUMNS * width + 2 * gap, index // COLUMNS * height
        page.text(x, y + 0.18, f"{name}: source | written | FLIP", limit=width - gap)
        for k, cell in enumerate(cells):
            page.image(x + k * (edge + gap), y + label, edge, edge, cell)
    return page.pixels()


def main() -> None:
    """Print one Markdown table and write the contact sheet."""
    study = Study(__doc__, __file__)
    study.add_argument("folder", type=Path, help="where the published networks are")
    study.add_argument("materials", nargs="*", default=TABULATED)
    study.add_argument("--size", type=int, default=192, help="pixels along an edge")
    study.add_argument("--spp", type=int, default=512, help="samples per pixel")
    options = study.options()
    lines, pictures = [], []
    for name in study.few(options.materials):
        with tempfile.TemporaryDirectory() as folder:
            network = options.folder / f"{name}.h5"
            line, cells = round_trip(network, Path(folder), options.size, options.spp)
        lines.append(line)
        pictures.append(cells)
        log(*line)
    columns = ("MERL to RGL", "PSNR", "FLIP", "noise, PSNR", "noise, FLIP")
    columns += ("PSNR without noise", "sphere, environment", "sphere, directional")
    study.table((*columns, "file", "convert"), lines)
    write_bytes(sheet([line[0] for line in lines], pictures), study.output / "sheet.png")


if __name__ == "__main__":
    main()
