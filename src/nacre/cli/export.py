"""`nacre export`."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.display import Line
from nacre.cli.kinds import kind_of
from nacre.cli.options import option
from nacre.cli.progress import progress
from nacre.cli.report import keyed, print_facts, print_json, print_table, report
from nacre.errors import NacreError

if TYPE_CHECKING:
    from nacre.export.textures import HeightField


@make(
    "export",
    options.argument("source", metavar="INPUT", required=False),
    option("--to target", metavar="TARGET", help="Target or place to write for; --list names all."),
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
    Standard materials, closures and tables hold any reflectance; it is fitted where it has to be.

    For a place, such as blender, what shows the material best there is written, with a readme of
    how to open it; the errors of what else the place can hold are listed.
    """
    from nacre.export import TARGETS
    from nacre.workflows.places import PLACES

    if listing:
        _print_targets()
        return
    if source is None or target is None:
        raise click.UsageError("expected an INPUT and --to TARGET, or --list")
    if target not in PLACES and target not in TARGETS:
        known = ", ".join((*TARGETS, *PLACES))
        raise click.BadParameter(f"--to {target}: is no known export target (known: {known})")
    line = progress(source.stem, "reading")
    loaded = _read(source, material, basis_name)
    if terms:
        loaded = loaded.replaced(source={**(loaded.source or {}), "terms": terms})
    write = _to_place if target in PLACES else partial(_to_target, _heights(height_field, depth))
    paths, facts = write(loaded, target, output or "", name or source.stem, line)
    files = [{"output": str(path), "size_bytes": path.stat().st_size} for path in paths]
    report(
        [f"{each['output']}: {each['size_bytes']:,} bytes" for each in files],
        {"target": target, "files": files, **facts},
    )


def _print_targets() -> None:
    from nacre.export import TARGETS
    from nacre.workflows.places import PLACES

    targets = [(name, member.title) for name, member in TARGETS.members()]
    places = [(name, ", ".join(each.title for each in held)) for name, held in PLACES.items()]
    print_json(
        [{"target": name, "title": title} for name, title in targets]
        + [{"place": name, "title": title} for name, title in places]
    )
    print_facts("targets", targets)
    print_facts("places, and what they can hold", places)


def _heights(path: Path | None, depth: float | None) -> HeightField | None:
    from nacre.export.textures import HeightField

    return HeightField.read(path, depth) if path is not None else None


def _to_target(
    heights: HeightField | None,
    material: Brdf | Btf,
    target: str,
    output: str,
    name: str,
    line: Line,
) -> tuple[list[Path], dict[str, Any]]:
    from nacre.export import export

    line("writing", 0, 1)
    paths = export(material, target, output, name=name, heights=heights, progress=line)
    line.end()
    return paths, {}


def _to_place(
    material: Brdf | Btf, place: str, output: str, name: str, line: Line
) -> tuple[list[Path], dict[str, Any]]:
    """Write the best representation, and print all."""
    from nacre.workflows.places import export_to_place

    options.refuse(("btf",), f"{place} is a place for reflectances")
    if isinstance(material, Btf):
        raise NacreError(f"{material.name}: is a texture, and {place} is a place for reflectances")
    candidates, paths = export_to_place(material, place, output, name=name, progress=line)
    line.end()
    rows = []
    for each in candidates:
        row: dict[str, Any] = {"representation": each.representation.title}
        for light in each.comparison.lights:
            errors = light.errors
            row |= {f"{light.light} FLIP": errors.flip, f"{light.light} PSNR": errors.psnr}
        rows.append(row | {"bytes": each.nbytes})
    columns = "", "environment: FLIP", "dB", "directional: FLIP", "dB", "bytes"
    print_table(columns, [list(row.values()) for row in rows])
    return paths, {"representations": [keyed(row) for row in rows]}


def _read(source: Path, material: str | None, basis_name: str) -> Brdf | Btf:
    """The material of a file, or of a code."""
    from nacre.formats import load_brdf, load_btf
    from nacre.latent.file import find_basis, is_code, load_code

    if is_code(source):
        options.refuse(("btf",), f"{source} is a code")
        return load_code(source, find_basis(basis_name))
    return load_btf(source) if kind_of(source) == "btf" else load_brdf(source, material)
