from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.display import Line
from nacre.cli.kinds import kind_of
from nacre.cli.options import option
from nacre.cli.ranges import FiniteRange
from nacre.cli.report import progress, report
from nacre.errors import printable
from nacre.figures.plot import CHANNELS, INCIDENCE

if TYPE_CHECKING:
    from nacre.brdf import Brdf

_Named = TypeVar("_Named")
_LOBES_ONLY = "--channel", "--cosine", "--floor"
_DEFAULT = ",".join(f"{math.degrees(angle):g}" for angle in INCIDENCE)


def _angles(text: str) -> tuple[float, ...]:
    degrees = options.floats(text)
    if len(degrees) > 6 or not all(0.0 <= angle < 90.0 for angle in degrees):
        raise ValueError(f"expected up to 6 degrees from 0 to below 90, like {_DEFAULT}")
    return degrees


@make(
    "plot",
    options.inputs_argument(),
    options.output_option(
        required=False, shown="NAME_lobes.png or NAME_spectrum.png; lobes.png for several"
    ),
    "Plot to write (.png, .svg, .pdf).",
    option("--spectrum", is_flag=True),
    "Plot f_r over wavelength, in the mirror direction and for a viewer at the normal.",
    option("--texel", options.TEXEL, applies="btf", metavar="X,Y", shown="the mean of all"),
    "Texel whose lobes to plot: column and row, counted from 0.",
    option("--incidence", options.Parsed("DEG,DEG", _angles), default=_DEFAULT),
    "Angles of the light from the normal, in degrees.",
    option("--azimuth", FiniteRange(-360.0, 360.0), default=0.0, metavar="DEG"),
    "Azimuth of the plane of incidence, for anisotropic materials.",
    option("--channel", CHANNELS, default="luminance", help="Channel to plot."),
    option("--cosine", is_flag=True, help="Multiply by the cosine of the viewing angle."),
    option("--floor", FiniteRange(1e-12, 1e12), shown="a power of ten below the plotted values"),
    "Value at the center in 1/sr.",
    reads=True,
)
def command(
    paths: tuple[Path, ...],
    output: Path | None,
    texel: tuple[int, int] | None,
    incidence: tuple[float, ...],
    azimuth: float,
    spectrum: bool,
    **chosen: Any,
) -> None:
    """Plot the lobes of materials over one another, in the plane of incidence, on a log scale.

    The first of several materials is a wide gray line below the others. Lines have gaps where
    nothing was measured. For a texture, the mean is plotted, or one --texel. With --spectrum, f_r
    of materials with bands is plotted over wavelength.
    """
    from nacre.figures.plot import check_count, check_plot_path, lobe_figure, write_plot
    from nacre.figures.spectrum import spectrum_figure

    kind = "spectrum" if spectrum else "lobes"
    for _, flag in options.given():
        if spectrum and flag in _LOBES_ONLY:
            raise click.UsageError(f"{flag} is for lobes; leave it or --spectrum out")
    output = output or Path(f"{paths[0].stem}_{kind}.png" if len(paths) == 1 else f"{kind}.png")
    check_plot_path(output)
    check_count(len(paths))
    options.check_outputs([output], paths)
    line = progress(output.stem)
    materials = []
    for index, path in enumerate(paths):
        line("reading", index, len(paths), path.name)
        materials.append((path, _load(path, texel, line, several=len(paths) > 1)))
    named = name_apart(materials)
    line("plotting", 0, 1)
    angles = tuple(map(math.radians, incidence))
    turn = math.radians(azimuth)
    if spectrum:
        figure = spectrum_figure(named, angles, azimuth=turn)
    else:
        figure = lobe_figure(named, angles, azimuth=turn, **chosen)
    write_plot(figure, output)
    data = {"output": str(output), "materials": list(named), "incidence_deg": list(incidence)}
    report(f"{output}: {', '.join(named)}", data)


def _load(path: Path, texel: tuple[int, int] | None, line: Line, *, several: bool) -> Brdf:
    from nacre.formats import load_brdf, load_btf
    from nacre.workflows import texture_reflectance

    # With several inputs, --texel concerns only the textures.
    if kind_of(path, refusing=not several) == "brdf":
        return load_brdf(path)
    return texture_reflectance(load_btf(path), texel, line)


def name_apart(materials: list[tuple[Path, _Named]]) -> dict[str, _Named]:
    """Materials, or readings of them, by file name; by path, and with a number, where names are the
    same.
    """
    named: dict[str, _Named] = {}
    for path, brdf in materials:
        name = next(n for n in (path.name, str(path)) if n == str(path) or n not in named)
        label, count = printable(name), 1
        while label in named:
            count += 1
            label = f"{printable(name)} ({count})"
        named[label] = brdf
    return named
