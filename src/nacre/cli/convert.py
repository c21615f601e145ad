"""`nacre convert`."""

from __future__ import annotations

from pathlib import Path

import click

from nacre.cli.console import check_outputs, console, file_path, resolution_option, status


@click.command("convert")
@click.argument("source", type=file_path())
@click.argument("target", type=file_path())
@click.option("--material", help="Which one, of a table that holds several.")
@resolution_option
def command(
    source: Path, target: Path, material: str | None, resolution: tuple[int, ...] | None
) -> None:
    """Write the material in SOURCE to TARGET, in the format that its name ends in.

    Any material becomes an RGL or UTIA table (.bsdf; .bin, .exr) or samples (.csv), any isotropic
    one a MERL table (.binary, .npz). Neural and analytic formats take only such materials:
    `nacre fit` makes one of a table.
    """
    from nacre.formats import check_target, load_brdf, loses_bands, writer

    write = writer(target, resolution)
    check_outputs([target], [source])
    brdf = load_brdf(source, material)
    check_target(target, brdf)
    write(brdf, target)
    if brdf.wavelengths is not None and (resolution or loses_bands(brdf, target)):
        note = f"{target}: holds the color of {source}, not its wavelengths; .csv keeps them"
        status.print(f"note: {note}", markup=False)
    console.print(f"{target}: {target.stat().st_size:,} bytes", markup=False)
