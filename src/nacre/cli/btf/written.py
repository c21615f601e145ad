"""What commands print of a texture that they wrote."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from nacre.cli.console import console, counted

if TYPE_CHECKING:
    from nacre.btf.texture import Btf
    from nacre.btf.ubo2014.writer import Loss


def print_written(path: Path, btf: Btf, loss: Loss | None) -> None:
    """A line, and one on what was clipped; `loss` is what :func:`nacre.btf.formats.save` gave."""
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
