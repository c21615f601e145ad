"""Draw included reflectances beside measurements: `python scripts/gallery_sheets.py [DATA]`.

A row of a sheet in `out/gallery/sheets` is a material: its measurement where DATA has it
(`rgl/NAME_rgb.bsdf`, `merl/NAME.binary`, as `nacre download` leaves them), its network, their FLIP
error, the network in directional light, its lobes for three lights, and its place among all by
their codes of the basis that comes with nacre. `make gallery-sheets` runs it.
"""

from __future__ import annotations

import math
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

import nacre
from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.color import luminance, tone_map
from nacre.figures.lobes import lobe
from nacre.figures.page import FAINT, INK, Page, magma
from nacre.figures.plot import COLORS
from nacre.formats import load_brdf
from nacre.geometry import split
from nacre.latent import pretrained_basis
from nacre.latent.map import embed
from nacre.metrics.metrics import flip, image_errors
from nacre.mitsuba.preview import write_bytes
from nacre.mitsuba.sphere import render_sphere, smooth_edges, standard_lights

SHEETS = Path(__file__).resolve().parents[1] / "out/gallery/sheets"
ROWS = 8
"""Materials on a sheet."""
CELL, GAP, LABEL, MARGIN = 1.3, 0.1, 0.24, 0.2
"""Inches: a picture, the space between two, the height of a name, the page's margin."""
INCIDENCE = 15, 45, 75
"""Degrees of the lights whose lobes are drawn."""
COLUMNS = "Measurement", "Network", "FLIP, 0 to 0.2", "Directional", "f_r, log", "Place"


@dataclass(frozen=True)
class Shown:
    """What a row shows of a material.

    Parameters
    ----------
    name
        As commands take it.
    pictures
        By column, display values of shape (size, size, 3); None where there is no measurement.
    psnr
        In dB to the measurement, in the environment; None where there is none.
    lobes
        For each of :data:`INCIDENCE` angles of the viewer in degrees and log10 of f_r in 1/sr.
    code
        Of the basis that comes with nacre, shape (32,).
    """

    name: str
    pictures: tuple[Floats | None, Floats, Floats | None, Floats]
    psnr: float | None
    lobes: list[tuple[Floats, Floats]]
    code: Floats


def measurement(name: str, data: Path | None) -> Brdf | None:
    """The table that a network was fitted to, where it is at hand."""
    family, _, stem = name.partition(":")
    places = {"merl": f"merl/{stem}.binary"}
    path = data and data / places.get(family, f"rgl/{stem}_rgb.bsdf")
    return load_brdf(path) if path and path.exists() else None


def shown(data: Path | None, name: str) -> Shown:
    """All that is drawn of a material."""
    network, lights = load_brdf(name), standard_lights()
    environment, directional = lights["environment"], lights["directional"]
    image, mask = render_sphere(network, environment)
    truth, error, psnr = None, None, None
    if (table := measurement(name, data)) is not None:
        measured = render_sphere(table, environment)[0]
        psnr = image_errors(measured, image, mask)[0].psnr
        error = magma(5.0 * flip(tone_map(measured), tone_map(image)))
        truth = tone_map(measured)
    lit = smooth_edges(render_sphere(network, directional)[0], network, directional)[0]
    lobes = []
    for degrees in INCIDENCE:
        traced = lobe(network, math.radians(degrees))
        values = np.log10(np.maximum(luminance(split(traced.rgb)), 1e-5))
        lobes.append((np.degrees(traced.theta), values))
    pictures = truth, tone_map(image), error, tone_map(lit)
    return Shown(name, pictures, psnr, lobes, pretrained_basis().encode(network))


def draw(page: Page, top: float, row: Shown, places: Floats, index: int) -> None:
    """One row."""
    note = f"   {row.psnr:.1f} dB" if row.psnr is not None else ""
    page.text(MARGIN, top + 0.17, row.name + note, 9.0, INK)
    top += LABEL
    left = [MARGIN + k * (CELL + GAP) for k in range(len(COLUMNS))]
    for x, picture in zip(left, row.pictures, strict=False):
        if picture is not None:
            page.sphere(x, top, CELL, picture)
        else:
            page.text(x + 0.5 * CELL, top + 0.5 * CELL, "none here", 8.0, FAINT, ha="center")
    axes = page.axes(left[4], top, CELL, CELL)
    for color, (theta, values) in zip(COLORS, row.lobes, strict=False):
        axes.plot(theta, values, color=color, linewidth=0.8)
    axes.set_xlim(-90.0, 90.0)
    axes.axhline(-math.log10(math.pi), color=FAINT, linewidth=0.4)
    axes = page.axes(left[5], top, CELL, CELL)
    axes.scatter(*places.T, s=1.5, color=FAINT, linewidths=0.0)
    axes.scatter(*places[index], s=22.0, color="#d62728")


def main(data: Path | None) -> None:
    """Draw all sheets, with a process a core."""
    names = [material.name for material in nacre.materials() if material.kind == "brdf"]
    found = []
    with ProcessPoolExecutor() as pool:
        for row in pool.map(partial(shown, data), names):
            found.append(row)
            print(f"{len(found)} of {len(names)}: {row.name}", flush=True)
    places = embed([row.code for row in found])
    SHEETS.mkdir(parents=True, exist_ok=True)
    width = 2.0 * MARGIN + len(COLUMNS) * (CELL + GAP) - GAP
    for start in range(0, len(found), ROWS):
        rows = found[start : start + ROWS]
        page = Page(width, 0.4 + len(rows) * (CELL + LABEL) + MARGIN)
        for k, title in enumerate(COLUMNS):
            page.text(MARGIN + k * (CELL + GAP), 0.25, title, 8.0, FAINT)
        for k, row in enumerate(rows):
            draw(page, 0.35 + k * (CELL + LABEL), row, places, start + k)
        path = SHEETS / f"{start // ROWS + 1:02}.png"
        write_bytes(page.pixels(), path)
        print(path)


if __name__ == "__main__":
    if len(sys.argv) > 2:
        raise SystemExit(__doc__)
    main(Path(sys.argv[1]) if sys.argv[1:] else None)
