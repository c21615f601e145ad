"""`nacre plot`."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path

import click

from nacre.brdf import Brdf
from nacre.cli.console import check_outputs, console, file_path
from nacre.cli.ranges import FiniteRange
from nacre.errors import NacreError, printable
from nacre.figures.plot import CHANNELS, INCIDENCE, MAX_MATERIALS

_DEFAULT = ",".join(f"{math.degrees(angle):g}" for angle in INCIDENCE)


def _angles(_context: click.Context, _parameter: click.Parameter, value: str) -> tuple[float, ...]:
    try:
        degrees = tuple(float(part) for part in value.split(","))
    except ValueError:
        degrees = (math.nan,)
    if len(degrees) > 6 or not all(0.0 <= angle < 90.0 for angle in degrees):
        raise click.BadParameter(f"expected up to 6 degrees from 0 to below 90, like {_DEFAULT}")
    return tuple(math.radians(angle) for angle in degrees)


@click.command("plot")
@click.argument("files", nargs=-1, required=True, type=file_path())
@click.option(
    "-o",
    "--output",
    type=file_path(),
    default="lobes.png",
    help="Plot to write: .png, .svg or .pdf.",
)
@click.option(
    "--incidence",
    default=_DEFAULT,
    callback=_angles,
    metavar="DEG,DEG",
    help="Angles between the light and the normal.",
)
@click.option(
    "--azimuth",
    type=FiniteRange(-360.0, 360.0),
    default=0.0,
    metavar="DEG",
    help="Of the plane, for anisotropic materials.",
)
@click.option("--channel", type=click.Choice(CHANNELS), default="luminance", help="What is drawn.")
@click.option("--cosine", is_flag=True, help="Multiply by the cosine of the viewer.")
@click.option(
    "--floor",
    type=FiniteRange(1e-12, 1e12),
    help="Value at the center in 1/sr. Default: a power of ten below what is drawn.",
)
def command(
    files: tuple[Path, ...],
    output: Path,
    incidence: tuple[float, ...],
    azimuth: float,
    channel: str,
    cosine: bool,
    floor: float | None,
) -> None:
    """Draw the lobes of materials over one another, in the plane of incidence, on a log scale.

    The first of several materials is a wide gray line beneath the others. Lines have gaps where
    nothing was measured.
    """
    from nacre.figures.plot import check_plot_path, lobe_figure, write_plot
    from nacre.formats import load_brdf

    check_plot_path(output)
    check_outputs([output], files)
    check_count(files)
    materials = name_apart((path, load_brdf(path)) for path in files)
    figure = lobe_figure(
        materials,
        incidence,
        azimuth=math.radians(azimuth),
        channel=channel,
        cosine=cosine,
        floor=floor,
    )
    write_plot(figure, output)
    console.print(f"{output}: {', '.join(materials)}", markup=False)


def check_count(files: tuple[Path, ...]) -> None:
    """Raise if one plot cannot hold as many materials."""
    if len(files) > MAX_MATERIALS:
        raise NacreError(f"a plot shows at most {MAX_MATERIALS} materials, not {len(files)}")


def name_apart(files: Iterable[tuple[Path, Brdf]]) -> dict[str, Brdf]:
    """Materials by the names of their files; by their paths, and numbers, where these are alike."""
    named: dict[str, Brdf] = {}
    for path, brdf in files:
        name = next(n for n in (path.name, str(path)) if n == str(path) or n not in named)
        label, count = printable(name), 1
        while label in named:
            count += 1
            label = f"{printable(name)} ({count})"
        named[label] = brdf
    return named
