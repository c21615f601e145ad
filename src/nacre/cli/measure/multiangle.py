from __future__ import annotations

from pathlib import Path
from typing import Any

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.measure.readings import (
    alternatives,
    azimuth_options,
    chosen,
    color_options,
    loaded,
    note_known,
    report_colors,
)
from nacre.cli.options import option
from nacre.cli.plot import name_apart
from nacre.cli.report import say


@make(
    "multiangle",
    options.argument("path", metavar="INPUT"),
    option("--angles", ["E2194", "E2539"], default="E2194"),
    "ASTM E2194: light at 45 degrees, six views in its plane. E2539: also light at 15 degrees, and "
    "views outside of the plane, 19 in all.",
    *color_options(),
    options.output_option("Plot of the colors to write (.png, .svg, .pdf).", required=False),
    *azimuth_options(),
    reads=True,
)
def command(
    path: Path,
    angles: str,
    illuminant: str,
    observer: str,
    standard: Path | None,
    output: Path | None,
    azimuth: float,
) -> None:
    """Read the color of a reflectance at several angles, and its flop index.

    45as15 is light at 45 degrees, seen 15 degrees from the mirror direction toward the light;
    45as25az90 is seen beside the plane of incidence.
    """
    from nacre.instruments import E2194, E2539, multiangle

    if output is not None:
        from nacre.figures.plot import check_plot_path

        check_plot_path(output)
        options.check_outputs([output], [path, standard])
    materials, line = loaded(path, standard)
    geometries = E2539 if angles == "E2539" else E2194
    settings = chosen(illuminant, observer, azimuth)
    found, *other = (multiangle(brdf, geometries, **settings) for brdf in materials)
    if output is not None:
        from nacre.figures.angles import multiangle_figure
        from nacre.figures.plot import write_plot

        line("plotting", 0, 1)
        paths = [each for each in (path, standard) if each is not None]
        write_plot(
            multiangle_figure(name_apart(list(zip(paths, (found, *other), strict=True)))), output
        )
    facts: dict[str, Any] = {"flop_index": found.flop_index, "known_fraction": found.known}
    facts |= {"output": str(output)} if output is not None else {}
    names = [geometry.name for geometry in geometries]
    plausible = [multiangle(each, geometries, **settings) for each in alternatives(materials[0])]
    others = [each.colors for each in plausible]
    report_colors(path, names, found.colors, other[0].colors if other else None, facts, others)
    if found.flop_index is not None:
        say(f"flop index {found.flop_index:.2f}")
    if output is not None:
        say(f"{output}: colors at {len(names)} angles")
    note_known(min(each.known for each in (found, *other)))
