from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.display import Line
from nacre.cli.kinds import kind_of
from nacre.cli.options import option
from nacre.cli.ranges import FiniteRange
from nacre.cli.report import keyed, print_facts, print_json, print_table, progress, report
from nacre.errors import NacreError, did_you_mean
from nacre.io.names import stem


@make(
    "export",
    options.argument("source", metavar="INPUT", required=False),
    option("--to target", metavar="TARGET", help="Target or place to write for; see --list."),
    option("-o --output", click.Path(), shown="NAME with the target's ending"),
    "File to write, or a folder/ for targets with several files.",
    option("--list listing", is_flag=True, help="List the targets and places."),
    option("--name", shown="INPUT's name", help="Prefix of the names in the output."),
    option("--license terms", metavar="TEXT", shown="those of the source, if known"),
    "Terms of use to put at the beginning of the output.",
    options.basis_option(),
    options.height_field_option(),
    "Gray image for parallax of an encoded texture; see nacre render.",
    options.depth_option(),
    option("--bytes-per-texel", FiniteRange(4.0, 32.0), metavar="B"),
    "Size of an encoded texture's texels, a multiple of 4; written as 8-bit textures.",
    reads=True,
)
def command(
    source: Path | None,
    target: str | None,
    output: str | None,
    name: str | None,
    basis_name: str,
    height_field: Path | None,
    depth: float | None,
    bytes_per_texel: float | None,
    terms: str | None,
    listing: bool,
) -> None:
    """Write a material as shader code or for another tool.

    Neural and analytic reflectances and latent codes become functions that evaluate, sample, and
    give the density of samples; encoded textures become functions and texture atlases. Standard
    materials, closures and tables can hold any reflectance, fitted if necessary.

    For a place, such as blender, nacre writes what shows the material best there, with a readme,
    and lists the errors of the alternatives.
    """
    from nacre.targets import TARGETS, export
    from nacre.targets.textures import HeightField
    from nacre.workflows.places import PLACES

    if listing:
        _print_targets()
        return
    if source is None or target is None:
        raise click.UsageError("expected an INPUT and --to TARGET, or --list")
    if target not in PLACES and target not in TARGETS:
        hint = did_you_mean(target, [*TARGETS, *PLACES], "nacre export --list shows them")
        raise click.BadParameter(f"--to {target}: is no known target or place{hint}")
    line = progress(source.stem, "reading")
    loaded = _read(source, basis_name)
    if terms:
        loaded = loaded.replaced(source={**(loaded.source or {}), "terms": terms})
    prefix = name or stem(source)
    facts: dict[str, Any] = {}
    if bytes_per_texel is not None and bytes_per_texel % 4:
        raise click.UsageError(f"--bytes-per-texel {bytes_per_texel:g}: expected a multiple of 4")
    if target in PLACES:
        if bytes_per_texel is not None:
            raise click.UsageError(f"--bytes-per-texel: {target} takes no textures")
        paths, facts = _to_place(loaded, target, output or "", prefix, line)
    else:
        heights = HeightField.read(height_field, depth) if height_field is not None else None
        line("writing", 0, 1)
        paths = export(
            loaded,
            target,
            output or "",
            name=prefix,
            heights=heights,
            bytes_per_texel=None if bytes_per_texel is None else int(bytes_per_texel),
            progress=line,
        )
    line.end()
    files = [{"output": str(path), "size_bytes": path.stat().st_size} for path in paths]
    report(
        [f"{each['output']}: {each['size_bytes']:,} bytes" for each in files],
        {"target": target, "files": files, **facts},
    )


def _print_targets() -> None:
    from nacre.targets import TARGETS
    from nacre.workflows.places import PLACES

    targets = [(name, member.title) for name, member in TARGETS.members()]
    places = [(name, ", ".join(each.title for each in held)) for name, held in PLACES.items()]
    print_json(
        [{"target": name, "title": title} for name, title in targets]
        + [{"place": name, "title": title} for name, title in places]
    )
    print_facts("targets", targets)
    print_facts("places, and what they can hold", places)


def _to_place(
    material: Brdf | Btf, place: str, output: str, name: str, line: Line
) -> tuple[list[Path], dict[str, Any]]:
    """Write the best representation, and print the errors of all."""
    from nacre.workflows.places import export_to_place

    options.refuse(("btf",), f"{place} takes reflectances only")
    if isinstance(material, Btf):
        raise NacreError(f"{material.name}: is a texture, but {place} takes reflectances only")
    candidates, paths = export_to_place(material, place, output, name=name, progress=line)
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


def _read(source: Path, basis_name: str) -> Brdf | Btf:
    from nacre.formats import load_brdf, load_btf
    from nacre.latent.file import find_basis, is_code, load_code

    if is_code(source):
        options.refuse(("btf",), f"{source} is a code")
        return load_code(source, find_basis(basis_name))
    return load_btf(source) if kind_of(source) == "btf" else load_brdf(source)
