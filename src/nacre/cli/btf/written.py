"""What commands report of a texture that they write, and put into it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre.cli.report import counted, report_file, say
from nacre.cli.session import session
from nacre.io.files import digest

if TYPE_CHECKING:
    from nacre.btf import Btf
    from nacre.measured.textures.ubo2014.writer import Loss
    from nacre.textures.latent_map import CodecFile, LatentMap


def report_texture(path: Path, btf: Btf, loss: Loss | None) -> None:
    """A line on a texture that was written; `loss` is what saving it gave."""
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
    if loss is not None and loss.negative and not session().as_json:
        clipped = f"{100.0 * loss.negative:.3g} % of the values were negative"
        say(f"{path}: {clipped} and became 0; an .npz keeps them")


def source_of(path: Path) -> dict[str, Any]:
    """What an encoded texture says of where it is from."""
    return {"file": path.resolve().name, "sha256": digest(path) if path.is_file() else None}


def written_reference(latent: LatentMap, source: Path, output: Path) -> CodecFile | None:
    """The codec's file, if the texture read from `source` names one that lies beside the output.

    None where the codec is to be embedded.
    """
    beside = source.resolve().parent == output.resolve().parent
    return latent.reference if beside else None
