"""`nacre latent train`."""

from __future__ import annotations

from pathlib import Path

import click

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.progress import progress
from nacre.cli.report import report_file


@make("train", writes=True, reports=True)
@options.inputs_argument("paths", metavar="INPUT...")
@options.output_option("Basis to write (.safetensors).")
@options.option(
    "--model",
    type=click.Choice(["neural", "hypernetwork", "autoencoder", "pca"]),
    default="pca",
    help="Kind of basis. neural: closest, 0.2 MB. hypernetwork: codes decode into networks of 675 "
    "weights; 0.6 MB. autoencoder: the paper's. pca: 16 MB. All but pca continue where they were "
    "stopped.",
)
@options.option(
    "--code-dim", default=32, type=click.IntRange(1, 1024), help="Latent size: values in a code."
)
@options.resolution_option(
    applies="pca",
    type=options.Integers("90,45,45", 3),
    metavar="N,N,N",
    show_default="90,45,45",
    help="Nodes of the grid: theta_h,theta_d,phi_d.",
)
@options.option(
    "--separate",
    applies="pca",
    is_flag=True,
    help="Train on each channel as a material of its own, not on the six channel permutations.",
)
@options.option(
    "--steps",
    applies="trained basis",
    type=click.IntRange(1),
    show_default="8000; 4000 for autoencoder",
    help="Optimizer steps.",
)
@options.seed_option(applies="trained basis", default=None, show_default="0")
def command(
    paths: tuple[Path, ...],
    output: Path,
    model: str,
    code_dim: int,
    resolution: tuple[int, ...] | None,
    separate: bool,
    steps: int | None,
    seed: int | None,
) -> None:
    """Train a basis on isotropic materials."""
    from nacre.workflows.basis_training import train_basis

    if output.suffix.lower() != ".safetensors":
        raise click.BadParameter(f"{output}: a basis is a .safetensors file")
    options.refuse(("trained basis" if model == "pca" else "pca",), f"this is --model {model}")
    options.check_outputs([output], paths)
    basis = train_basis(
        paths,
        output,
        model,
        code_dim=code_dim,
        resolution=resolution,
        separate=separate,
        steps=steps,
        seed=seed,
        progress=progress(output.stem),
    )
    text = f"{len(paths)} materials, latent size {code_dim}, {basis.nbytes:,} bytes in memory"
    data = {"model": model, "materials": len(paths), "code_dim": code_dim}
    if model in ("neural", "hypernetwork"):
        text += ", predicts lobes for importance sampling"
    report_file(output, text, memory_bytes=basis.nbytes, **data)
