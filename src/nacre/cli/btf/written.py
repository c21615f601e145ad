"""What commands print of a texture that they wrote."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from nacre.cli.console import console

if TYPE_CHECKING:
    from nacre.btf.texture import Btf


def print_written(path: Path, btf: Btf, error: float | None) -> None:
    """One line; `error` is what :func:`nacre.btf.formats.save` gave."""
    facts = [
        f"{btf.width} x {btf.height} texels",
        f"{btf.pair_count:,} pairs of directions",
        f"{path.stat().st_size:,} bytes",
    ]
    if error is not None:
        facts.append(f"mean absolute error {100.0 * error:.2g} % of the mean value")
    console.print(f"{path}: {', '.join(facts)}", markup=False)
