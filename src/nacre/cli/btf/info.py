"""`nacre btf info`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from nacre.cli.btf.options import pixels_option
from nacre.cli.console import file_path, print_facts, print_json

if TYPE_CHECKING:
    from nacre.btf.image_folder import Quantity


_UNITS = {
    "largest polar angle of lights": "degrees",
    "largest polar angle of views": "degrees",
    "value range": "reflectance factor, of a sample",
    "mean value": "reflectance factor, of a sample",
    "bytes as half floats": "bytes",
    "bytes": "bytes",
}


@click.command("info")
@click.argument("path", type=file_path())
@pixels_option
@click.option("--json", "as_json", is_flag=True, help="One object, as JSON.")
def command(path: Path, pixels: Quantity | None, as_json: bool) -> None:
    """Show what is in the texture at PATH: a file, a folder of images, or a list of photographs."""
    from nacre.btf.formats import load, recognised
    from nacre.btf.selection import some_values

    btf = load(path, pixels)
    values = some_values(btf)
    facts = btf.describe() | {
        "value range": [float(values.min()), float(values.max())],
        "mean value": [float(x) for x in values.mean(axis=0, dtype=float)],
        "format": recognised(path).name,
        "file": str(path),
    }
    if path.is_file():
        facts["bytes"] = path.stat().st_size
    units = {key: unit for key, unit in _UNITS.items() if key in facts}
    if as_json:
        print_json({"facts": facts, "units": units})
    else:
        print_facts(path.resolve().name, facts.items(), units)
