"""`nacre convert`."""

from __future__ import annotations

from pathlib import Path

import click

from nacre.cli.console import check_outputs, console, file_path, status


@click.command("convert")
@click.argument("source", type=file_path())
@click.argument("target", type=file_path())
@click.option("--material", help="Which one, of a table that holds several.")
def command(source: Path, target: Path, material: str | None) -> None:
    """Write the material in SOURCE to TARGET, in the format that its name ends in.

    Any material becomes an RGL table (.bsdf) or samples (.csv), any isotropic one a MERL table
    (.binary). Neural and analytic formats take only such materials: `nacre fit` makes one of a
    table.
    """
    from nacre.formats import load, loses_bands, save, writer

    writer(target)
    check_outputs([target], [source])
    brdf = load(source, material)
    save(brdf, target)
    if loses_bands(brdf, target):
        note = f"{target}: holds the colour of {source}, not its wavelengths; .csv keeps them"
        status.print(f"note: {note}", markup=False)
    console.print(f"{target}: {target.stat().st_size:,} bytes", markup=False)
