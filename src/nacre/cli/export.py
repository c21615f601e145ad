"""`nacre export`."""

from __future__ import annotations

from pathlib import Path

import click

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.materials import kind_of
from nacre.cli.options import option
from nacre.cli.progress import progress
from nacre.cli.report import print_facts, print_json, report


@make(
    "export",
    options.argument("source", metavar="INPUT", required=False),
    option("--to target", metavar="TARGET", help="Target to write for; --list names all."),
    option("-o --output", click.Path(), shown="NAME with the ending of the target"),
    "File to write, or a folder/; a folder where a target has several files.",
    option("--name", shown="that of INPUT", help="Beginning of the names in the output."),
    option("--material", applies="brdf", help="Name of the material, for a file of several."),
    options.basis_option(),
    option("--height-field", options.INPUT, applies="btf"),
    "Gray image for parallax of an encoded texture; see nacre render.",
    option("--depth", options.FiniteRange(0.0), applies="btf", shown="0.1; 1 of .exr"),
    "Depth of the height field from black to white, in widths of the texture.",
    option("--license terms", metavar="TEXT", shown="what is known of the source"),
    "Terms of use of the source, which the output begins with.",
    option("--list listing", is_flag=True, help="List the targets."),
)
def command(
    source: Path | None,
    target: str | None,
    output: str | None,
    name: str | None,
    material: str | None,
    basis_name: str,
    height_field: Path | None,
    depth: float | None,
    terms: str | None,
    listing: bool,
) -> None:
    """Write a material as shader code, or for another tool.

    Neural and analytic reflectances, and codes of nacre latent, become functions that evaluate,
    sample, and give the density of samples; encoded textures become functions and texture atlases.
    """
    from nacre.export import TARGETS, export
    from nacre.export.textures import HeightField

    if listing:
        known = [(each, member.title) for each, member in TARGETS.members()]
        print_json([{"target": each, "title": title} for each, title in known])
        print_facts("targets", known)
        return
    if source is None or target is None:
        raise click.UsageError("expected an INPUT and --to TARGET, or --list")
    TARGETS.find(target)
    line = progress(source.stem, "reading")
    loaded = _read(source, material, basis_name)
    if terms:
        loaded = loaded.replaced(source={**(loaded.source or {}), "terms": terms})
    heights = HeightField.read(height_field, depth) if height_field is not None else None
    line("writing", 0, 1)
    paths = export(loaded, target, output or "", name=name or source.stem, heights=heights)
    line.end()
    files = [{"output": str(path), "size_bytes": path.stat().st_size} for path in paths]
    report(
        [f"{each['output']}: {each['size_bytes']:,} bytes" for each in files],
        {"target": target, "files": files},
    )


def _read(source: Path, material: str | None, basis_name: str) -> Brdf | Btf:
    """The material of a file, or of a code."""
    from nacre.formats import load_brdf, load_btf
    from nacre.latent.file import find_basis, is_code, load_code

    if is_code(source):
        options.refuse(("btf",), f"{source} is a code")
        return load_code(source, find_basis(basis_name))
    return load_btf(source) if kind_of(source) == "btf" else load_brdf(source, material)
