from __future__ import annotations

from pathlib import Path

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.measure.readings import (
    azimuth_options,
    chosen,
    color_options,
    note_known,
    report_colors,
)
from nacre.cli.options import option
from nacre.cli.report import progress, say


@make(
    "multiangle",
    options.argument("path", metavar="INPUT"),
    option("--angles", ["E2194", "E2539"], default="E2194"),
    "ASTM E2194: light at 45 degrees, six views in its plane. E2539: also light at 15 degrees, and "
    "views outside of the plane, 19 in all.",
    *color_options(),
    *azimuth_options(),
    writes=False,
    reads=True,
)
def command(
    path: Path,
    angles: str,
    illuminant: str,
    observer: str,
    standard: Path | None,
    azimuth: float,
) -> None:
    """Read the color of a reflectance at several angles, and its flop index.

    45as15 is light at 45 degrees, seen 15 degrees from the mirror direction toward the light;
    45as25az90 is seen beside the plane of incidence.
    """
    from nacre.formats import load_brdf
    from nacre.instruments import E2194, E2539, multiangle

    line = progress(path.stem, "reading")
    materials = [load_brdf(each) for each in (path, standard) if each is not None]
    line("measuring", 0, 1)
    geometries = E2539 if angles == "E2539" else E2194
    settings = chosen(illuminant, observer, azimuth)
    found, *other = (multiangle(brdf, geometries, **settings) for brdf in materials)
    facts = {"flop_index": found.flop_index, "known_fraction": found.known}
    names = [geometry.name for geometry in geometries]
    report_colors(path, names, found.colors, other[0].colors if other else None, facts)
    if found.flop_index is not None:
        say(f"flop index {found.flop_index:.2f}")
    note_known(min(each.known for each in (found, *other)))
