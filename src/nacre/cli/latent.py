"""`nacre latent`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from nacre.cli.console import Stages, check_outputs, console, file_path, numbers
from nacre.cli.latent_views import basis_option, chart, interpolate
from nacre.cli.ranges import SEED


@click.group("latent", no_args_is_help=False)
def command() -> None:
    """Materials as codes of a few values, in a basis that they share.

    The basis is functions that a small network gives, principal components on a grid, or a network
    that gives the weights of others.
    """


@command.command("train")
@click.argument("inputs", metavar="INPUT...", nargs=-1, required=True, type=file_path())
@click.option("-o", "--output", required=True, type=file_path(), help="Basis (.safetensors).")
@click.option(
    "--model",
    metavar="[pca|neural|hypernetwork|autoencoder]",
    default="pca",
    show_default=True,
    help="neural: closer, 0.2 MB. hypernetwork: codes decode into networks of 675 weights; 0.6 MB. "
    "autoencoder: the paper's. These resume where they were stopped. pca: 16 MB.",
)
@click.option("--code-dim", type=click.IntRange(1, 1024), help="Values in a code.  [default: 32]")
@click.option(
    "--resolution",
    callback=numbers,
    metavar="N,N,N",
    help="Nodes of the grid of pca: theta_h,theta_d,phi_d.  [default: 90,45,45]",
)
@click.option(
    "--separate",
    is_flag=True,
    default=None,
    help="Take each channel as a material of its own, in place of the six permutations (pca).",
)
@click.option(
    "--steps",
    type=click.IntRange(1),
    help="Optimizer steps, except for pca.  [default: 8000, autoencoder: 4000]",
)
@click.option("--seed", type=SEED, help="Random seed, except for pca.  [default: 0]")
def train(
    inputs: tuple[Path, ...],
    output: Path,
    model: str,
    resolution: tuple[int, ...] | None,
    **chosen: Any,
) -> None:
    """Make a basis from isotropic materials: files, or folders of measured files."""
    from nacre.measured.merl import Resolution
    from nacre.workflows import train_basis

    if resolution:
        if len(resolution) != 3:
            raise click.BadParameter("--resolution: expected theta_h,theta_d,phi_d, like 90,45,45")
        try:
            chosen["resolution"] = Resolution(*resolution)
        except ValueError as error:
            raise click.BadParameter(f"--resolution: {error}") from error
    check_outputs([output], inputs)
    options = {name: value for name, value in chosen.items() if value is not None}
    with Stages() as stages:
        basis = train_basis(
            inputs,
            output,
            model,
            options,
            progress=stages.add("basis"),
            left_out=lambda path: console.print(f"{path}: no material, left out", markup=False),
        )
    size = f"{len(basis.metadata['materials'])} materials, {basis.code_dim} values"
    lobes = ", predicts lobes for importance sampling" if basis.predictors else ""
    console.print(f"{output}: {size}, {basis.nbytes:,} bytes{lobes}", markup=False)


@command.command("encode")
@click.argument("source", metavar="INPUT", type=file_path())
@basis_option
@click.option("-o", "--output", required=True, type=file_path(), help="Code (.json).")
@click.option(
    "--refine/--no-refine",
    default=True,
    show_default=True,
    help="Refine the code for pictures. Without it, a code of pca is closest in the logarithm, and "
    "one of autoencoder is what the encoder gives; the others have no such code.",
)
def encode(source: Path, basis_name: str, output: Path, refine: bool) -> None:
    """Find the code of an isotropic material."""
    from nacre.formats import load_brdf
    from nacre.latent import find_basis, save_code

    if output.suffix.lower() != ".json":
        raise click.BadParameter(f"{output}: a code is a .json file")
    check_outputs([output], [source, Path(basis_name)])
    basis = find_basis(basis_name)
    brdf = load_brdf(source)
    code = basis.encode(brdf, refine=refine)
    save_code(basis.decode(code, brdf.name), output)
    console.print(f"{output}: {len(code)} values ({4 * len(code)} bytes)", markup=False)


@command.command("decode")
@click.argument("source", metavar="CODE", type=file_path())
@basis_option
@click.option(
    "-o",
    "--output",
    required=True,
    type=file_path(),
    help="Material (.binary, .bsdf, ...); networks also as .safetensors, .h5.",
)
def decode(source: Path, basis_name: str, output: Path) -> None:
    """Write the material that a code stands for, in the format of the output's name."""
    from nacre.formats import check_target, writer
    from nacre.latent import find_basis, load_code

    write = writer(output)
    check_outputs([output], [source, Path(basis_name)])
    material = load_code(source, find_basis(basis_name))
    check_target(output, material)
    write(material, output)
    console.print(f"{output}: {output.stat().st_size:,} bytes", markup=False)


command.add_command(interpolate)
command.add_command(chart)
