"""`nacre btf info`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nacre.cli.btf.options import pixels_option
from nacre.cli.console import file_path, print_facts, print_json
from nacre.errors import FormatError

if TYPE_CHECKING:
    from nacre.measured.textures.image_folder import Quantity


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
    """Show what is in the texture at PATH: a file, a folder of images, or a list of photographs.

    PATH may also be a model of nacre btf train: what kind it is, of which sizes, and how it was
    trained.
    """
    from nacre.io.tensors import has_header
    from nacre.textures.codecs.codec_file import KEY, codec_facts

    if not has_header(path, KEY):
        facts = _texture_facts(path, pixels)
    elif pixels is None:
        facts = codec_facts(path)
    else:
        raise FormatError(f"{path}: is a model, which has no images; leave out --pixels")
    units = {key: unit for key, unit in _UNITS.items() if key in facts}
    if as_json:
        print_json({"facts": facts, "units": units})
    else:
        print_facts(path.resolve().name, facts.items(), units)


def _texture_facts(path: Path, pixels: Quantity | None) -> dict[str, Any]:
    from nacre.formats import identify, load_btf
    from nacre.textures.selection import some_values

    btf = load_btf(path, quantity=pixels)
    values = some_values(btf)
    facts = btf.describe() | {
        "value range": [float(values.min()), float(values.max())],
        "mean value": [float(x) for x in values.mean(axis=0, dtype=float)],
        "format": identify(path).name,
        "file": str(path),
    }
    if path.is_file():
        facts["bytes"] = path.stat().st_size
    return facts
