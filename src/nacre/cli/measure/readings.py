"""What the commands of instruments share: options, tables of colors, notes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre.cli import options
from nacre.cli.layout import Option
from nacre.cli.options import option
from nacre.cli.ranges import FiniteRange
from nacre.cli.report import note, print_table, progress, report, say
from nacre.errors import printable

if TYPE_CHECKING:
    from nacre.brdf import Brdf
    from nacre.cli.display import Line
    from nacre.instruments import Color

_KNOWN = 0.9995  # what rounds to 100 %
_GRAY = 0.005  # chroma of colors whose hue is noise
_HUE = 4  # place of the hue in a row of numbers


def azimuth_options() -> list[Option | str]:
    """Rows of every command of an instrument."""
    return [
        option("--azimuth", FiniteRange(-360.0, 360.0), default=0.0, metavar="DEG"),
        "Azimuth of the plane of incidence, for anisotropic materials.",
    ]


def color_options() -> list[Option | str]:
    """Rows of commands that read colors; their values go to functions of an instrument."""
    return [
        option("--illuminant", ["D65", "A", "F11"], default="D65"),
        "Light that the color is for. A material known in RGB has an exact color under D65 for the "
        "2-degree observer; else a smooth spectrum is assumed.",
        option("--observer", ["2", "10"], default="2"),
        "Field of view of the CIE observer, in degrees.",
        option("--standard", options.INPUT, metavar="MATERIAL"),
        "Material to compare with: adds CIEDE2000 differences.",
    ]


def chosen(illuminant: str, observer: str, azimuth: float) -> dict[str, Any]:
    """Parameters of an instrument that reads colors."""
    return {"illuminant": illuminant, "observer": int(observer), "azimuth": azimuth}


def loaded(path: Path, standard: Path | None) -> tuple[list[Brdf], Line]:
    """The material to read and any that it is compared with, and the line of their progress."""
    from nacre.formats import load_brdf

    line = progress(path.stem, "reading")
    materials = [load_brdf(each) for each in (path, standard) if each is not None]
    line("measuring", 0, 1)
    return materials, line


def alternatives(brdf: Brdf) -> list[Brdf]:
    """Materials that are as plausible as one that is known with some uncertainty."""
    from nacre.latent.estimates import ENOUGH, plausible

    return plausible(brdf)[:ENOUGH]


def report_colors(
    path: Path,
    names: Sequence[str],
    colors: Sequence[Color],
    standard: Sequence[Color] | None,
    facts: dict[str, Any],
    others: Sequence[Sequence[Color]] = (),
) -> None:
    """Print colors, one a row, with differences to a standard, or all as JSON with `facts`.

    `others` are the colors of :func:`alternatives`, which give intervals.
    """
    from nacre.latent.intervals import interval

    columns = ["geometry", "L*", "a*", "b*", "C*", "h", "Y"]
    if others:
        columns.append("L* within")
        ends = interval([[color.lab for color in each] for each in others])
    rows, data = [], []
    for index, (name, color) in enumerate(zip(names, colors, strict=True)):
        numbers = [*color.lab, color.chroma, color.hue, color.xyz[1]]
        entry = {"geometry": name, "lab": list(color.lab), "chroma": color.chroma}
        entry |= {"hue_deg": color.hue, "xyz": list(color.xyz)}
        if others:
            low, high = (end[index].tolist() for end in ends)
            entry |= {"lab_low": low, "lab_high": high}
        if standard is not None:
            difference = color.difference(standard[index])
            numbers.append(difference)
            entry["ciede2000"] = difference
        shown = [f"{round(number, 2) + 0.0:.2f}" for number in numbers]
        if color.chroma < _GRAY:
            shown[_HUE] = ""
        if others:
            shown.insert(len(columns) - 2, f"{low[0]:.2f} to {high[0]:.2f}")
        rows.append([name, *shown])
        data.append(entry)
    first = colors[0]
    say(printable(path.resolve().name), style="bold")
    print_table([*columns, "dE00"] if standard is not None else columns, rows)
    about = {"illuminant": first.illuminant, "observer_deg": first.observer}
    report([], {"file": str(path), **about, "estimated": first.estimated, **facts, "colors": data})
    if first.estimated:
        note(
            f"known in RGB only: the color under {first.illuminant} for {first.observer} degrees "
            "is that of a smooth spectrum, an estimate"
        )


def note_band(brdf: Brdf) -> None:
    """Say so where a reading is that of one band."""
    from nacre.brdf import COLOR

    if brdf.channels != COLOR:
        note(f"measured at {brdf.channels[0]} only: the reading is that of this wavelength")


def note_known(known: float) -> None:
    """Say so where a reading rests on directions at which f_r is not known."""
    if known < _KNOWN:
        note(
            f"f_r is known at {known:.1%} of the directions; at the others it is 0 or extrapolated"
        )
