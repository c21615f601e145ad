"""`nacre info`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from nacre.brdf import Brdf
from nacre.cli.console import (
    check_outputs,
    console,
    file_path,
    print_facts,
    print_json,
    raise_all,
)
from nacre.errors import NacreError

_UNITS = {
    "value range": "1/sr",
    "table range": "as stored",
    "invalid samples": "share of nodes",
    "points with a negative channel": "share of tabulated points",
    "points below the horizon": "share of tabulated points",
    "memory bytes": "bytes",
    "wavelengths nm": "nm",
    "bytes": "bytes",
    "training loss": "mean log-cosine loss",
    "held out loss": "mean log-cosine loss",
}
"""What the facts that files give are in."""


@click.command("info")
@click.argument("files", nargs=-1, required=True, type=file_path())
@click.option(
    "--physics/--no-physics",
    default=True,
    help="Integrate energy, reciprocity and anisotropy.",
)
@click.option("--plot", type=file_path(), help="Lobe plot of all FILES: .png, .svg or .pdf.")
@click.option("--json", "as_json", is_flag=True, help="A list with one object a file, as JSON.")
def command(files: tuple[Path, ...], physics: bool, plot: Path | None, as_json: bool) -> None:
    """Show what is in a measured table or a neural material, and whether it is physical."""
    from nacre.formats import load_brdf

    if plot is not None:
        from nacre.cli.plot import check_count
        from nacre.figures.plot import check_plot_path

        check_plot_path(plot)
        check_outputs([plot], files)
        check_count(files)
    failures, found, shown = [], [], []
    for path in files:
        try:
            brdf = load_brdf(path)
        except NacreError as error:
            failures.append(error)
            continue
        facts, units = _facts(path, brdf, physics)
        shown.append((path, brdf))
        if as_json:
            found.append({"facts": facts, "units": units})
        else:
            print_facts(path.name, facts.items(), units)
    if as_json:
        print_json(found)
    if plot is not None and shown:
        _draw(shown, plot)
        if not as_json:
            console.print(f"{plot}: lobes in the plane of incidence", markup=False)
    raise_all(failures)


def _facts(path: Path, brdf: Brdf, physics: bool) -> tuple[dict[str, Any], dict[str, str]]:
    """What there is to say about a material, and what the values are in."""
    facts = dict(brdf.describe())
    units = dict(_UNITS)
    if physics:
        from nacre.metrics.facts import UNITS, physical_facts

        facts |= physical_facts(brdf)
        units |= UNITS
    facts["file"] = str(path)
    facts["bytes"] = path.stat().st_size
    facts["sha256"] = (brdf.source or {}).get("sha256", "")
    return facts, {key: unit for key, unit in units.items() if key in facts and unit}


def _draw(materials: list[tuple[Path, Brdf]], path: Path) -> None:
    """The lobe plot of some materials."""
    from nacre.cli.plot import name_apart
    from nacre.figures.plot import lobe_figure, write_plot

    write_plot(lobe_figure(name_apart(materials)), path)
