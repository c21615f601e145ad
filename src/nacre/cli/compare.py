"""`nacre compare`."""

from __future__ import annotations

import dataclasses
import itertools
from pathlib import Path

import click

from nacre.cli.console import (
    Stages,
    check_outputs,
    console,
    environment_option,
    file_path,
    print_json,
    print_table,
)


@click.command("compare")
@click.argument("truth", type=file_path())
@click.argument("other", type=file_path())
@click.option(
    "-o",
    "--output",
    type=file_path(),
    help="Picture to write, .png or .jpg. Default: OTHER_compared.png in this folder.",
)
@environment_option
@click.option("--size", type=click.IntRange(16, 2048), default=128, help="Pixels of the spheres.")
@click.option("--json", "as_json", is_flag=True, help="Print the figures as one JSON object.")
def command(
    truth: Path,
    other: Path,
    output: Path | None,
    environment: Path | None,
    size: int,
    as_json: bool,
) -> None:
    """Compare a material with the TRUTH: error figures, and a picture of both with FLIP maps."""
    from nacre.figures import picture
    from nacre.formats import load_brdf
    from nacre.metrics import compare
    from nacre.render.environment import load_environment
    from nacre.render.preview import DISPLAY_IMAGES, check_image_path, write_bytes

    output = output or Path(f"{other.stem}_compared.png")
    check_image_path(output, DISPLAY_IMAGES)
    check_outputs([output], [truth, other])
    materials = load_brdf(truth), load_brdf(other)
    lighting = load_environment(environment) if environment else None
    with Stages() as stages:
        report = stages.add(other.stem)
        comparison = compare(
            *materials,
            size=size,
            environment=lighting,
            progress=lambda part: report("comparing", round(100 * part), 100),
        )
    comparison = dataclasses.replace(comparison, truth=truth.name, other=other.name)
    write_bytes(picture(comparison), output)
    if as_json:
        figures: dict[str, dict[str, float]] = {}
        for where, measure, value in comparison.rows():
            figures.setdefault(where, {})[measure] = value
        names = {"truth": str(truth), "other": str(other), "picture": str(output)}
        print_json({**names, "figures": figures})
        return
    for light, rows in itertools.groupby(comparison.rows(), lambda row: row[0]):
        print_table((light, ""), [row[1:] for row in rows])
    console.print(f"{output}: truth | other | FLIP error", markup=False)
