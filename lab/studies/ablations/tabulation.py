"""What a written table loses: MERL, UTIA, RGL and MDL files against the material they were made of.

Each source is written with `nacre.save`, read again and held against itself:

- the error of f_r cos over 20,000 uniform pairs of directions, relative to the value or to 1 % of
  the mean, whichever is larger: median and 95th percentile;
- the sum of what an RGL table interpolates below 0, relative to the sum of f_r cos over pairs whose
  light the table itself draws: nacre clamps it, Mitsuba's `measured` does not;
- PSNR of the deterministic sphere (:mod:`nacre.mitsuba.sphere`, 96 pixels, 256 light directions)
  under the environment and under the directional light. The sphere knows views and lights up to the
  horizon, which a UTIA table has to extrapolate from 75 degrees.

Sources are Lambert plus GGX of a roughness, or of two, Beckmann's distribution without a diffuse
part, and whatever files are named. A file that is a table already is tabulated anew here, as any
other material.

Run `python -m lab.studies.ablations.tabulation [FILE...] [--format .bsdf]`.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import numpy.typing as npt

import nacre
from lab.studies.study import Study
from nacre.array import Array, Components
from nacre.brdf import Brdf
from nacre.geometry import from_spherical, join, split
from nacre.measured import RglBrdf
from nacre.metrics import compare
from tests.oracles.reflectances import Beckmann, Glossy, Rotated

PAIRS = 20_000
FORMATS = ".binary", ".bin", ".bsdf", ".mbsdf"
ISOTROPIC = ".binary", ".mbsdf"
SOURCES = {
    "diffuse": Glossy(0.5, 0.0, 0.5),
    "glossy, 0.3": Glossy(0.2, 0.05, 0.3),
    "sharp, 0.1": Glossy(0.1, 0.3, 0.1),
    "sharp, 0.03": Glossy(0.1, 0.5, 0.03),
    "anisotropic, 0.15 x 0.5": Glossy(0.1, 0.3, 0.15, 0.5),
    "anisotropic, 0.05 x 0.2": Glossy(0.1, 0.3, 0.05, 0.2),
    "the same, axes off x and y": Rotated(0.1, 0.3, 0.05, 0.2),
    "metal, 0.03": Beckmann(0.0, 1.0, 0.03),
    "metal, 0.15 x 0.5": Beckmann(0.0, 1.0, 0.15, 0.5),
    "metal, 0.05 x 0.3": Beckmann(0.0, 1.0, 0.05, 0.3),
}


def hemisphere(random: np.random.Generator, count: int) -> npt.NDArray[np.float32]:
    """Uniform directions above the horizon, shape (count, 3)."""
    u = random.random((2, count), np.float32)
    return join(from_spherical(np.arccos(1.0 - u[0]), 2.0 * np.pi * u[1]))


class Source(Brdf):
    """A reflectance of which writers know nothing but that it answers `eval` and `valid`."""

    def __init__(self, brdf: Brdf) -> None:
        self.brdf, self.name, self.isotropic = brdf, brdf.name, brdf.isotropic

    def eval_components(self, wi: Components, wo: Components) -> Components:
        """See :class:`nacre.brdf.Brdf`."""
        return self.brdf.eval_components(wi, wo)

    def valid_components(self, wi: Components, wo: Components) -> Array:
        """See :class:`nacre.brdf.Brdf`."""
        return self.brdf.valid_components(wi, wo)


def negative(table: RglBrdf, wo: npt.NDArray[np.floating]) -> float:
    """What is below 0 of what is reflected, over samples of the table."""
    u = np.random.default_rng(1).random((len(wo), 3))
    wi, pdf = table.sample(wo, u)
    kept = pdf > 0.0
    wi, wo, pdf = wi[kept], wo[kept], pdf[kept]
    values = np.stack(table.eval_components(split(wi), split(wo)), -1) * wi[:, 2:] / pdf[:, None]
    return float(np.maximum(-values, 0.0).sum() / np.abs(values).sum())


def row(name: str, source: Brdf, ending: str) -> tuple[str, ...]:
    """One line of the table."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"table{ending}"
        nacre.save(source, path)
        length = path.stat().st_size
        table = nacre.load(path)
    random = np.random.default_rng(3)
    wi, wo = hemisphere(random, PAIRS), hemisphere(random, PAIRS)
    truth = source.eval(wi, wo) * wi[:, 2:]
    size = np.abs(truth)
    error = np.abs(table.eval(wi, wo) * wi[:, 2:] - truth) / np.maximum(size, 0.01 * size.mean())
    lights = compare(source, table, size=96, directions=256).lights
    return (
        name,
        ending,
        f"{100 * np.median(error):.2f} %",
        f"{100 * np.quantile(error, 0.95):.1f} %",
        f"{100 * negative(table, wo):.3f} %" if isinstance(table, RglBrdf) else "",
        *(f"{light.errors.psnr:.1f} dB" for light in lights),
        f"{length / 1e6:.1f} MB",
    )


def main() -> None:
    """Print one Markdown table."""
    study = Study(__doc__, __file__)
    study.add_argument("files", nargs="*", type=Path, help="materials; the made ones if none")
    study.add_argument("--format", action="append", choices=FORMATS)
    options = study.options()
    sources = {path.stem: nacre.load(path) for path in options.files} or SOURCES
    rows = [
        row(name, Source(brdf), ending)
        for ending in options.format or FORMATS
        for name, brdf in sources.items()
        if ending not in ISOTROPIC or brdf.isotropic
    ]
    columns = "source", "table", "median", "95th percentile", "below 0", "environment"
    study.table((*columns, "directional light", "size"), rows)


if __name__ == "__main__":
    main()
