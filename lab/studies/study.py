"""What all studies share: their options, real measurements, tables, errors of pictures."""

from __future__ import annotations

import argparse
import os
import statistics
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

import nacre
from nacre.brdf import Brdf
from nacre.measured.merl import tabulate
from nacre.metrics import compare
from nacre.mitsuba.environment import Environment, load_environment
from nacre.runtime.progress import Progress
from nacre_lab.reproduce.cache import Cache
from nacre_lab.reproduce.tables import markdown_table, write_csv, write_text

TABULATED = (
    *("chrome", "gold-metallic-paint", "pink-fabric", "blue-acrylic", "black-phenolic"),
    *("blue-rubber", "cherry-235", "pink-felt"),
)
"""Published networks of MERL materials that stand in for the tables they were fitted to."""
PICTURE_ERRORS = "environment: MAE / SSIM / PSNR", "directional"
"""Columns of :func:`triples`."""

_ROOT = Path(__file__).resolve().parents[2]
_VARIABLES = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")
_Item = TypeVar("_Item")


class Study(argparse.ArgumentParser):
    """The command line of a study, and where its tables go.

    Parameters
    ----------
    doc, file
        Of its module.
    """

    def __init__(self, doc: str | None, file: str) -> None:
        name = Path(file).stem
        shape = argparse.RawDescriptionHelpFormatter
        super().__init__(f"python -m lab.studies.*.{name}", description=doc, formatter_class=shape)
        folder = _ROOT / "out" / "studies" / name
        self.add_argument("--data", type=Path, help="folder of measurements (default: NACRE_DATA)")
        self.add_argument("-o", "--output", type=Path, default=folder, help="folder of results")
        self.add_argument("--seed", type=int, default=0, help="of everything random (default: 0)")
        self.add_argument("--quick", action="store_true", help="little work: figures to look at")
        self._name = name
        self._options = argparse.Namespace()

    def options(self) -> argparse.Namespace:
        """The options given; child processes find the same measurements."""
        self._options = self.parse_args()
        if self._options.data:
            os.environ["NACRE_DATA"] = str(self._options.data.resolve())
        return self._options

    @property
    def output(self) -> Path:
        """The folder of results, which is there."""
        folder: Path = self._options.output
        folder.mkdir(parents=True, exist_ok=True)
        return folder

    @property
    def cache(self) -> Cache:
        """What is kept from one run to the next, in a folder of its own below the results."""
        return Cache(self.output / "cache")

    def few(self, items: Sequence[_Item], count: int = 2) -> Sequence[_Item]:
        """All items, or the first few with `--quick`."""
        return items[:count] if self._options.quick else items

    def table(
        self, columns: Sequence[str], rows: Iterable[Sequence[str]], part: str = "", note: str = ""
    ) -> None:
        """Print a table, and write it as Markdown and as CSV.

        Parameters
        ----------
        columns, rows
            Texts; all but the first column to the right.
        part
            Of the study, for the names of the files, where it has several tables.
        note
            A line below.
        """
        rows = list(rows)
        text = markdown_table(columns, rows) + (f"\n{note}\n" if note else "")
        print(f"{part}\n\n{text}" if part else text, flush=True)
        path = self.output / "-".join([self._name, *part.split()])
        write_csv(columns, rows, path.with_name(f"{path.name}.csv"))
        write_text(text, path.with_name(f"{path.name}.md"))


def log(*words: object) -> None:
    """A line on how far a study is, on standard error."""
    print(*words, file=sys.stderr, flush=True)


def progress(stage: str, done: int, total: int, text: str) -> None:
    """The same of a training or a fit, over and over."""
    print(f"\r{stage} {done} of {total} {text}   ", end="", file=sys.stderr, flush=True)


_: Progress = progress


def data(*parts: str) -> Path:
    """A real measurement, or a folder of some: below NACRE_DATA, else `../shared/data`.

    Ends the process where it is not there.
    """
    named = os.environ.get("NACRE_DATA")
    folder = Path(named) if named else _ROOT.parent / "shared" / "data"
    path = folder.joinpath(*parts)
    if not path.exists():
        sys.exit(f"{path} is not there: give the folder of measurements by --data or NACRE_DATA")
    return path


def rgl_tables(pattern: str = "*.bsdf") -> list[Path]:
    """Measured tables of the RGL database."""
    return sorted(data("rgl").glob(pattern))


def rgl_names() -> list[str]:
    """Materials of the RGL database that have a table of RGB."""
    return [path.stem.removesuffix("_rgb") for path in rgl_tables("*_rgb.bsdf")]


def museum() -> Environment:
    """The environment map that pictures are lit by."""
    return load_environment(data("environment", "museum.exr"))


def materials() -> Iterator[tuple[str, Brdf]]:
    """Name and reflectance of the RGL tables, and of published networks as MERL tables."""
    for path in rgl_tables():
        yield path.stem.removesuffix("_rgb"), nacre.load(path)
    for name in TABULATED:
        yield name, tabulate(nacre.load(data("pretrained", "merl", f"{name}.h5")))


def prevent_oversubscription() -> None:
    """One thread per process in the libraries of the processes started from here on."""
    os.environ.update(dict.fromkeys(_VARIABLES, "1"))


def picture_errors(
    truth: Brdf, other: Brdf, environment: Environment, **options: Any
) -> list[float]:
    """MAE, SSIM and PSNR of spheres under the environment, then under the directional light."""
    lights = compare(truth, other, environment=environment, **options).lights
    return [value for x in lights for value in (x.errors.mae, x.errors.ssim, x.errors.psnr)]


def triples(errors: Sequence[float], worst: Sequence[float] = ()) -> list[str]:
    """The cells of :data:`PICTURE_ERRORS`; in parentheses the worst PSNR, where given."""
    cells = [f"{mae:.4f} / {ssim:.4f} / {psnr:.1f}" for mae, ssim, psnr in (errors[:3], errors[3:])]
    if not len(worst):
        return cells
    lowest = worst[2], worst[5]
    return [f"{cell} ({low:.1f})" for cell, low in zip(cells, lowest, strict=True)]


def geometric_mean(values: Sequence[float]) -> float:
    """Of positive numbers."""
    return statistics.geometric_mean(values)


def mean_square(a: Any, b: Any) -> float:
    """Of differences."""
    return float(np.square(a - b).mean(dtype=float))
