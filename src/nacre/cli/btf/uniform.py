"""What the commands that make uniform textures share."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from nacre.cli.btf.written import report_texture
from nacre.cli.materials import expect
from nacre.cli.report import report_facts

if TYPE_CHECKING:
    from nacre.btf import Btf

OUTPUT_HELP = "File to write: codes (.safetensors), or values in a format of textures."


def is_encoded(output: Path) -> bool:
    """Whether codes are written rather than values."""
    return output.suffix.lower() == ".safetensors"


def check_codec(output: Path, codec: Path | None) -> None:
    """Refuse a codec that is none, or that nothing is encoded by, and formats that are unknown."""
    from nacre.formats import target

    encoded = is_encoded(output)
    if not encoded:
        target(output, "btf")
    if codec is None:
        return
    if not encoded:
        raise click.BadParameter("--codec encodes; it is for an output that ends in .safetensors")
    expect(codec, "a texture codec")


def write(texture: Btf, output: Path, model: Path | None, size: tuple[int, int] = (1, 1)) -> None:
    """Write a texture of one texel, repeated to width and height, and report what it became."""
    from nacre.btf import TableBtf
    from nacre.formats import save
    from nacre.metrics.texture_errors import UNITS
    from nacre.textures.codecs.codec_file import PUBLISHED, load_codec
    from nacre.textures.latent_file import save_latent_map
    from nacre.textures.latent_map import LatentMap
    from nacre.workflows.encoding import encode

    width, height = size
    if not is_encoded(output):
        values = np.broadcast_to(texture.texels(slice(0, 1)), (height, width, len(texture.wi), 3))
        uniform = TableBtf(values, texture.wi, texture.wo, texture.name)
        report_texture(output, uniform, save(uniform, output))
        return
    model = model or PUBLISHED
    codec = load_codec(model)
    found = encode(texture, codec)
    codes = np.tile(found.codes, (height, width, 1))
    facts: dict[str, Any] = {"model": model.name, "errors": found.errors.facts()}
    latent = LatentMap(codes, codec, texture.wi, texture.wo, texture.name, None, facts)
    save_latent_map(latent, output)
    shown, _ = found.errors.shown()
    rows = {"texels": f"{width} x {height}", **shown, "bytes": output.stat().st_size}
    report_facts(output.name, rows, UNITS, output=str(output))
