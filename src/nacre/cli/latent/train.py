from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from nacre.cli import options, plans
from nacre.cli.command import command as make
from nacre.cli.options import option
from nacre.cli.ranges import IntRange
from nacre.cli.report import counted, note, progress, report_file


@make(
    "train",
    options.inputs_argument(),
    options.output_option("Basis to write (.safetensors)."),
    option("--model", metavar="NAME", default="pca"),
    "Kind of basis. pca: principal components, 16 MB. neural: more accurate, 0.2 MB. hypernetwork: "
    "decodes into networks with the paper's inputs (675 weights), 0.6 MB. autoencoder: the "
    "paper's, for the same networks; predicts lobes, as neural does. All but pca resume where they "
    "stopped.",
    option("--code-dim", IntRange(1, 1024), shown="32"),
    "Number of values in a code.",
    options.resolution_option(options.integers("90,45,45", 3), metavar="N,N,N", shown="90,45,45"),
    "Nodes per axis of the grid for pca: theta_h,theta_d,phi_d.",
    option("--separate", is_flag=True, default=None),
    "Train pca on each channel as a separate material, not on the six permutations of channels.",
    option("--steps", IntRange(1), shown="8,000"),
    "Optimizer steps, except for pca.",
    option("--mixtures", IntRange(0), shown="12,000"),
    "Number of mixtures of materials that an autoencoder also learns from.",
    options.seed_option(default=None, shown="0"),
    "Random seed, except for pca.",
    plans=True,
)
def command(
    paths: tuple[Path, ...],
    output: Path,
    model: str,
    resolution: tuple[int, ...] | None,
    **chosen: Any,
) -> None:
    """Train a basis on isotropic materials, from files or folders of measured files."""
    from nacre.measured.merl import Resolution
    from nacre.workflows import train_basis
    from nacre.workflows.sources import find_sources

    if resolution:
        try:
            chosen["resolution"] = Resolution(*resolution)
        except ValueError as error:
            raise click.BadParameter(f"--resolution: {error}") from error
    options.check_outputs([output], paths)
    settings = {name: value for name, value in chosen.items() if value is not None}
    if plans.is_wanted():
        found = [source.path for source in find_sources(paths, output.parent / output.stem)]
        work = f"train a basis ({model}) on {counted(len(found), 'material', 'materials')}"
        plans.tell(found, [(output, "")], work)
        return
    line = progress(output.stem, "reading")
    basis = train_basis(
        paths,
        output,
        model,
        settings,
        progress=line,
        left_out=lambda path: note(f"{path}: is not a material, left out"),
    )
    count = len(basis.metadata["materials"])
    text = f"{count} materials, latent size {basis.code_dim}, {basis.nbytes:,} bytes in memory"
    if basis.predictors:
        text += ", predicts lobes for importance sampling"
    report_file(
        output,
        text,
        model=model,
        materials=count,
        code_dim=basis.code_dim,
        memory_bytes=basis.nbytes,
    )
