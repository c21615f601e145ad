"""`nacre latent`."""

from __future__ import annotations

from functools import partial
from pathlib import Path

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
@click.argument("files", nargs=-1, required=True, type=file_path())
@click.option("-o", "--output", required=True, type=file_path(), help="Basis (.safetensors).")
@click.option(
    "--model",
    type=click.Choice(["neural", "hypernetwork", "autoencoder", "pca"]),
    default="pca",
    show_default=True,
    help="neural: closer, 0.2 MB. hypernetwork: codes decode into networks of 675 weights; 0.6 MB. "
    "autoencoder: the paper's. These go on where they were stopped. pca: 16 MB.",
)
@click.option("--values", default=32, type=click.IntRange(1, 1024), help="Values of a code.")
@click.option(
    "--resolution",
    callback=numbers,
    metavar="N,N,N",
    help="Nodes of the grid of pca: theta_h,theta_d,phi_d.  [default: 90,45,45]",
)
@click.option(
    "--separate",
    is_flag=True,
    help="Take each channel as a material of its own, in place of the six permutations; pca only.",
)
@click.option(
    "--steps",
    type=click.IntRange(1),
    help="Optimizer steps; not of pca.  [default: 8000, autoencoder: 4000]",
)
@click.option("--seed", type=SEED, help="Of the training, not of pca.  [default: 0]")
def train(
    files: tuple[Path, ...],
    output: Path,
    model: str,
    values: int,
    resolution: tuple[int, ...] | None,
    separate: bool,
    steps: int | None,
    seed: int | None,
) -> None:
    """Make a basis from the isotropic materials in FILES."""
    from nacre import latent
    from nacre.formats import load_brdf
    from nacre.latent.file import AnyBasis, save_basis
    from nacre.measured.merl import Resolution

    if output.suffix.lower() != ".safetensors":
        raise click.BadParameter(f"{output}: a basis is a .safetensors file")
    if model != "pca" and (resolution or separate):
        raise click.BadParameter("--resolution and --separate are for --model pca")
    if model == "pca" and (steps is not None or seed is not None):
        raise click.BadParameter("--steps and --seed are not for --model pca")
    if resolution and len(resolution) != 3:
        raise click.BadParameter("--resolution: expected theta_h,theta_d,phi_d, like 90,45,45")
    try:
        grid = {"resolution": Resolution(*resolution)} if resolution else {}
    except ValueError as error:
        raise click.BadParameter(f"--resolution: {error}") from error
    check_outputs([output], files)
    chosen = {"steps": steps, "seed": seed}
    settings = {key: value for key, value in chosen.items() if value is not None}
    states = [output.with_name(f"{output.name}.{name}") for name in ("state", "hypernetwork.state")]
    basis: AnyBasis
    with Stages() as stages:
        materials = [partial(load_brdf, path) for path in files]
        report = stages.add("basis")
        if model == "pca":
            basis = latent.train(materials, values, separate=separate, progress=report, **grid)
        elif model == "autoencoder":
            from nacre.render.sphere import lit_pixels

            coder = latent.AutoencoderRecipe(values=values, **settings)
            basis = latent.train_autoencoder(
                materials, lit_pixels(), coder, checkpoint=states[0], progress=report
            )
        else:
            recipe = latent.BasisRecipe(values=values, **settings)
            basis = latent.train_neural(materials, recipe, checkpoint=states[0], progress=report)
            most = min(recipe.steps, latent.PredictorRecipe.steps)
            lobes = latent.PredictorRecipe(steps=most, seed=recipe.seed)
            basis = latent.with_predictors(basis, lobes, progress=report)
            if model == "hypernetwork":
                basis = latent.train_hypernetwork(
                    basis,
                    latent.HypernetworkRecipe(**settings),
                    checkpoint=states[1],
                    progress=stages.add("hypernetwork"),
                )
    save_basis(basis, output)
    if model != "pca":
        for state in states:
            state.unlink(missing_ok=True)
    size = f"{len(files)} materials, {values} values, {basis.nbytes:,} bytes"
    if model in ("neural", "hypernetwork"):
        size += ", predicts lobes for importance sampling"
    console.print(f"{output}: {size}", markup=False)


@command.command("encode")
@click.argument("source", type=file_path())
@basis_option
@click.option("-o", "--output", required=True, type=file_path(), help="Code (.json).")
@click.option(
    "--project",
    is_flag=True,
    help="Do not optimize the code for pictures: of pca it is closest in the logarithm, of "
    "autoencoder what the encoder gives.",
)
def encode(source: Path, basis_name: str, output: Path, project: bool) -> None:
    """Find the code of the isotropic material in SOURCE."""
    from nacre.formats import load_brdf
    from nacre.latent import Autoencoder, Basis, find_basis
    from nacre.latent import encode as find
    from nacre.latent.file import save_code

    if output.suffix.lower() != ".json":
        raise click.BadParameter(f"{output}: a code is a .json file")
    check_outputs([output], [source, Path(basis_name)])
    basis = find_basis(basis_name)
    if not project:
        code = find(basis, brdf := load_brdf(source))
    elif isinstance(basis, Basis | Autoencoder):
        code = basis.project(brdf := load_brdf(source))
    else:
        raise click.BadParameter(
            f"--project: {basis_name} holds no principal components and no encoder"
        )
    save_code(basis.decode(code, brdf.name), output)
    console.print(f"{output}: {len(code)} values ({4 * len(code)} bytes)", markup=False)


@command.command("decode")
@click.argument("source", type=file_path())
@basis_option
@click.option(
    "-o",
    "--output",
    required=True,
    type=file_path(),
    help="Material (.binary, .bsdf, ...); networks also as .safetensors, .h5.",
)
def decode(source: Path, basis_name: str, output: Path) -> None:
    """Write the material that the code in SOURCE stands for, in the format of the output's name."""
    from nacre.formats import check_target, writer
    from nacre.latent import find_basis
    from nacre.latent.file import load_code

    write = writer(output)
    check_outputs([output], [source, Path(basis_name)])
    material = load_code(source, find_basis(basis_name))
    check_target(output, material)
    write(material, output)
    console.print(f"{output}: {output.stat().st_size:,} bytes", markup=False)


command.add_command(interpolate)
command.add_command(chart)
