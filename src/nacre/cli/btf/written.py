"""What commands print of a texture that they write, and put into it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre.cli.console import console, counted
from nacre.io.files import digest

if TYPE_CHECKING:
    from nacre.btf import Btf
    from nacre.measured.textures.ubo2014.writer import Loss
    from nacre.textures.latent_map import CodecFile, LatentMap


def print_written(path: Path, btf: Btf, loss: Loss | None) -> None:
    """A line, and one on what was clipped; `loss` is what :func:`nacre.save`
    gave.
    """
    facts = [
        f"{btf.width} x {btf.height} texels",
        counted(btf.pair_count, "pair of directions", "pairs of directions"),
        f"{path.stat().st_size:,} bytes",
    ]
    if loss is not None:
        facts.append(f"mean absolute error {100.0 * loss.error:.3g} % of the mean absolute value")
    console.print(f"{path}: {', '.join(facts)}", markup=False)
    if loss is not None and loss.negative:
        share = f"{100.0 * loss.negative:.3g} % of the values were negative"
        console.print(f"{path}: {share} and became 0; an .npz keeps them", markup=False)


def source_of(path: Path) -> dict[str, Any]:
    """What an encoded texture says of where it is from."""
    return {"file": path.resolve().name, "sha256": digest(path) if path.is_file() else None}


def written_reference(latent: LatentMap, source: Path, output: Path) -> CodecFile | None:
    """The model's file, if the texture read from `source` names one that lies beside the output.

    None where the model is to be embedded.
    """
    beside = source.resolve().parent == output.resolve().parent
    return latent.reference if beside else None
