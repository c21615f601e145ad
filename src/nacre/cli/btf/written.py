"""Textures that commands write: the content of the file, and the report."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from nacre.cli.kinds import expect
from nacre.cli.report import counted, report_facts, report_file, say
from nacre.io.files import digest

if TYPE_CHECKING:
    from nacre.btf import Btf
    from nacre.measured.textures.ubo2014.writer import Loss
    from nacre.textures.latent_map import CodecFile, LatentMap
    from nacre.workflows.encoding import EncodedTexture

OUTPUT_HELP = "File to write: codes (.safetensors), or values in a texture format."


def report_texture(path: Path, btf: Btf, loss: Loss | None) -> None:
    """Report a written texture; `loss` is the result of saving it."""
    pairs = counted(btf.pair_count, "pair of directions", "pairs of directions")
    text = f"{btf.width} x {btf.height} texels, {pairs}"
    data: dict[str, Any] = {
        "kind": "btf",
        "width": btf.width,
        "height": btf.height,
        "direction_pairs": btf.pair_count,
    }
    if loss is not None:
        text += f", mean absolute error {100.0 * loss.error:.3g} % of the mean absolute value"
        data |= {"relative_mae": loss.error, "negative_fraction": loss.negative}
    report_file(path, text, **data)
    if loss is not None and loss.negative:
        clipped = f"{100.0 * loss.negative:.3g} % of the values were negative"
        say(f"{path}: {clipped} and became 0; an .npz keeps them")


def report_codes(found: EncodedTexture, file: str) -> None:
    """Report an encoded texture, made from a file."""
    from nacre.metrics.texture_errors import UNITS

    height, width, code_dim = found.latent.shape
    nbytes = found.latent.held.nbytes
    shown, by_view = found.errors.shown()
    source = {}
    if found.source_nbytes:
        ratio = found.source_nbytes / found.nbytes
        source = {"bytes of the source": found.source_nbytes, "ratio": ratio}
    facts = {
        "width": width,
        "height": height,
        "code dim": code_dim,
        **shown,
        "pairs compared a texel": found.compared,
        **{f"MSE x 1e4, views {name}": mse for name, mse in by_view.items()},
        "seconds": found.seconds,
        "bytes of codes": nbytes,
        "bytes per texel": nbytes / (width * height),
        "bytes": found.nbytes,
        **source,
    }
    beside = found.beside and found.beside.name
    names = {"file": file, "output": str(found.path), "keep_beside": beside}
    report_facts(found.path.name, facts, UNITS, **names)
    if beside:
        say(f"{found.path}: keep {beside} beside it")


def source_of(path: Path) -> dict[str, Any]:
    """What an encoded texture stores about its source."""
    return {"file": path.resolve().name, "sha256": digest(path) if path.is_file() else None}


def written_reference(latent: LatentMap, source: Path, output: Path) -> CodecFile | None:
    """The codec file that `source` names, if it is beside the output too; else embed the codec."""
    beside = source.resolve().parent == output.resolve().parent
    return latent.reference if beside else None


def is_encoded(output: Path) -> bool:
    return output.suffix.lower() == ".safetensors"


def check_codec(output: Path, codec: Path | None) -> None:
    """Refuse an unknown format, a file that is not a codec, and a codec without codes to write."""
    from nacre.formats import target

    encoded = is_encoded(output)
    if not encoded:
        target(output, "btf")
    if codec is None:
        return
    if not encoded:
        raise click.BadParameter("--codec is for an output that ends in .safetensors")
    expect(codec, "a texture codec")


def write(texture: Btf, output: Path, model: Path | None, size: tuple[int, int] = (1, 1)) -> None:
    """Write a texture of one texel, repeated to width and height, and report the result."""
    from nacre.btf import TableBtf
    from nacre.formats import save
    from nacre.metrics.texture_errors import UNITS
    from nacre.textures.codecs.codec_file import codec_path, load_codec
    from nacre.textures.latent_file import save_latent_map
    from nacre.textures.latent_map import LatentMap
    from nacre.workflows.encoding import encode

    width, height = size
    if not is_encoded(output):
        values = np.broadcast_to(texture.texels(slice(0, 1)), (height, width, len(texture.wi), 3))
        uniform = TableBtf(values, texture.wi, texture.wo, texture.name)
        report_texture(output, uniform, save(uniform, output))
        return
    model = codec_path(model)
    codec = load_codec(model)
    found = encode(texture, codec)
    codes = np.tile(found.codes, (height, width, 1))
    facts: dict[str, Any] = {"model": model.name, "errors": found.errors.facts()}
    latent = LatentMap(codes, codec, texture.wi, texture.wo, texture.name, None, facts)
    save_latent_map(latent, output)
    shown, _ = found.errors.shown()
    rows = {"texels": f"{width} x {height}", **shown, "bytes": output.stat().st_size}
    report_facts(output.name, rows, UNITS, output=str(output))
