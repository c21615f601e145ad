"""`nacre btf train`."""

from __future__ import annotations

import glob
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from nacre.cli.btf.kinds import expect
from nacre.cli.btf.options import pixels_option
from nacre.cli.console import Stages, check_outputs, console, counted, file_path
from nacre.cli.ranges import SEED, FiniteRange
from nacre.errors import NacreError

if TYPE_CHECKING:
    from nacre.btf import Btf

_NETWORKS_ONLY = (
    "recipe_name",
    "minutes",
    "pooling",
    "decoder",
    "loss",
    "batch",
    "learning_rate",
    "patience",
    "bfloat16",
    "device",
    "events",
)


@click.command("train")
@click.argument("files", nargs=-1, required=True, type=file_path())
@click.option("-o", "--output", required=True, type=file_path(), help="Model (.safetensors).")
@click.option(
    "--model",
    type=click.Choice(["basis", "unified", "custom"]),
    default="basis",
    help="basis: ours, encodes textures of any directions, trained on those of one set in minutes. "
    "unified: of any directions (Rainer et al. 2020). custom: of one set of directions, made for "
    "one texture (Rainer et al. 2019).",
)
@click.option(
    "--recipe",
    "recipe_name",
    type=click.Choice(["reference", "efficient"]),
    default="efficient",
    help="Of networks. reference: as the paper trains, which takes days. efficient: ours.",
)
@click.option(
    "--minutes", type=FiniteRange(0.0, 1e6, min_open=True), help="Length, about; of networks."
)
@click.option(
    "--steps",
    type=click.IntRange(1),
    help="Length; of basis, steps of both its "
    "stages.  [default: 10000, of networks 100 epochs of 100 texels a texture, 1000 of the "
    "reference]",
)
@click.option(
    "--latent",
    type=click.IntRange(1, 1024),
    help="Values of a code, up to 128 of basis.  [default: 32, custom: 8]",
)
@click.option(
    "--pooling",
    type=click.Choice(["mean", "max"]),
    help="How the unified encoder pools entries.  [default: mean]",
)
@click.option(
    "--decoder",
    type=click.Choice(["network", "bilinear"]),
    default="network",
    help="Of networks. network: the paper's. bilinear: coefficients of a code times features of "
    "directions.",
)
@click.option(
    "--loss", type=click.Choice(["l1", "l2"]), help="Of networks.  [default: l1, custom: l2]"
)
@click.option(
    "--batch",
    type=click.IntRange(1),
    help="Texels a step; of networks.  [default: 32, of the reference 10]",
)
@click.option(
    "--learning-rate",
    type=FiniteRange(0.0, 1e3, min_open=True),
    help="Its peak; of networks.  [default: 0.01, of the reference 0.2]",
)
@click.option(
    "--patience",
    default=0,
    type=click.IntRange(0),
    help="Of networks: stop after so many looks at held-out texels, 200 steps apart, that show "
    "nothing better; 0 for never.",
)
@click.option(
    "--bfloat16",
    is_flag=True,
    help="Of networks: multiply matrices in bfloat16, which many processors do fast.",
)
@click.option("--half", is_flag=True, help="Write weights in half precision.")
@click.option("--device", default="cpu", help="PyTorch device of networks: cpu, cuda, cuda:1.")
@click.option("--seed", default=0, type=SEED, help="Of everything random.")
@click.option(
    "--events", type=file_path(), help="Folder for a log of networks that TensorBoard reads."
)
@click.option("--resume", is_flag=True, help="Go on where the same command was stopped.")
@pixels_option
@click.pass_context
def command(
    context: click.Context,
    files: tuple[Path, ...],
    output: Path,
    model: str,
    recipe_name: str,
    minutes: float | None,
    steps: int | None,
    latent: int | None,
    pooling: str | None,
    decoder: str,
    loss: str | None,
    batch: int | None,
    learning_rate: float | None,
    patience: int,
    bfloat16: bool,
    half: bool,
    device: str,
    seed: int,
    events: Path | None,
    resume: bool,
    pixels: Any,
) -> None:
    """Train a model that makes texels of the textures in FILES into a few values, and back.

    The default model, basis, takes --steps, --latent, --half, --seed, --resume and --pixels only.
    It learns from textures of the same pairs of directions, 100 texels of each and four a value of
    a code at least: two textures or more.

    Beside the output it keeps its state (OUTPUT.state, of basis OUTPUT.state.*.stage) until it is
    done, from which --resume goes on: after Ctrl-C nothing is lost, and a minute at most when it is
    killed. Of unified and custom there is a table of the losses too, OUTPUT.journal.csv, which
    stays, and several processes train together where torchrun starts them:
    torchrun --nproc-per-node 2 -m nacre btf train ...
    """
    if output.suffix.lower() != ".safetensors":
        raise click.BadParameter(f"{output}: a model is a .safetensors file")
    if steps is not None and minutes is not None:
        raise click.BadParameter("--steps and --minutes: give one of them")
    for path in files:
        expect(path, "a texture", "an encoded texture")
    if model == "basis":
        for name in _NETWORKS_ONLY:
            if context.get_parameter_source(name) is ParameterSource.COMMANDLINE:
                option = "--recipe" if name == "recipe_name" else f"--{name.replace('_', '-')}"
                raise click.BadParameter(f"{option} is for --model unified and custom")
        _train_basis(files, output, pixels, steps, latent, seed, half, resume)
        return
    if model == "custom" and pooling is not None:
        raise click.BadParameter("--pooling is for --model unified")
    from functools import partial

    from nacre.textures.codecs.codec_file import save_codec
    from nacre.textures.codecs.networks import CustomSettings, TrainingRecipe, UnifiedSettings
    from nacre.textures.codecs.networks.distributed import processes
    from nacre.textures.codecs.networks.training import train_network
    from nacre.textures.formats import load
    from nacre.textures.identity import source_mark

    state, journal = (
        output.with_name(f"{output.name}.{kind}") for kind in ("state", "journal.csv")
    )
    _check_begun(output, [state], resume)
    check_outputs([output, state, journal], files)
    sizes = {"latent": latent, "pooling": pooling, "decoder": decoder}
    given = {key: value for key, value in sizes.items() if value is not None}
    settings = UnifiedSettings(**given) if model == "unified" else CustomSettings(**given)
    defaults: dict[str, Any] = {} if model == "unified" else {"loss": "l2", "permute": False}
    chosen = {
        "loss": loss,
        "batch": batch,
        "learning_rate": learning_rate,
        "precision": "bfloat16" if bfloat16 else None,
    }
    chosen = {key: value for key, value in chosen.items() if value is not None}
    recipe = TrainingRecipe.named(
        recipe_name, **{**defaults, **chosen, "patience": patience, "seed": seed}
    )
    with processes(device) as (members, own), Stages() as stages:
        network = train_network(
            files,
            partial(load, quantity=pixels),
            settings,
            recipe,
            steps=steps,
            minutes=minutes,
            checkpoint=state,
            mark=f"{[source_mark(path) for path in files]} {pixels}",
            journal=journal,
            events=events,
            device=own,
            members=members,
            progress=stages.add(output.stem) if members.rank == 0 else None,
        )
    if members.rank:
        return
    save_codec(network, output, "half" if half else "single")
    state.unlink(missing_ok=True)
    facts = [
        counted(network.metadata["steps"], "step", "steps"),
        counted(network.values, "value a code", "values a code"),
    ]
    if network.metadata["held out"] is not None:
        facts.append(f"loss on held-out texels {network.metadata['held out']:.4f}")
    facts.append(f"{output.stat().st_size:,} bytes")
    console.print(f"{output}: {', '.join(facts)}", markup=False)


def _train_basis(
    files: tuple[Path, ...],
    output: Path,
    pixels: Any,
    steps: int | None,
    latent: int | None,
    seed: int,
    half: bool,
    resume: bool,
) -> None:
    """Train the default codec."""
    from dataclasses import asdict, replace
    from functools import partial

    from nacre.textures.codecs.basis.file import VERSION
    from nacre.textures.codecs.basis.recipe import BasisRecipe
    from nacre.textures.codecs.basis.stages import Stages as KeptStages
    from nacre.textures.codecs.basis.training import train_basis
    from nacre.textures.codecs.codec_file import save_codec
    from nacre.textures.formats import load
    from nacre.textures.identity import source_mark

    if int(os.environ.get("WORLD_SIZE", "1")) > 1:
        raise click.UsageError("--model basis is trained by one process; leave out torchrun")
    recipe = BasisRecipe(seed=seed)
    if latent is not None:
        most = recipe.greys + 2 * recipe.chromas
        if latent > most:
            raise click.BadParameter(f"--latent: basis has up to {most} values a code")
        recipe = replace(recipe, values=latent)
    if steps is not None:
        share = recipe.function_steps / (recipe.function_steps + recipe.code_steps)
        first = max(1, round(share * steps))
        recipe = replace(recipe, function_steps=first, code_steps=max(1, steps - first))
    sources = [source_mark(path) for path in files]
    mark = f"{VERSION} {recipe} {sources} {pixels}"
    kept = KeptStages(output.with_name(f"{output.name}.state"), mark)
    _check_begun(output, kept.files, resume)
    check_outputs([output], files)

    def opened(path: Path) -> Btf:
        """A texture by the name that its errors should have."""
        return load(path, pixels).replaced(name=str(path))

    textures = [partial(opened, path) for path in files]
    with Stages() as stages:
        try:
            codec = train_basis(textures, recipe, stages.add(output.stem), kept)
        except NacreError:
            if not kept.has("components"):  # no more than some texels, and one may be to blame
                kept.remove()
            raise
    facts = {"materials": [path.stem for path in files], "training": asdict(recipe)}
    save_codec(replace(codec, metadata=facts), output, "half" if half else "single")
    kept.remove()
    console.print(
        f"{output}: {recipe.function_steps + recipe.code_steps:,} steps, "
        f"{counted(codec.values, 'value', 'values')} a code, {output.stat().st_size:,} bytes",
        markup=False,
    )


def _check_begun(output: Path, own: list[Path], resume: bool) -> None:
    """Refuse to begin where a training was stopped, or to go on with one of another model.

    States of the output begin with its name; `own` are those that this model has, or would have.
    """
    begin = f"{output.name}.state"
    states = sorted(output.parent.glob(f"{glob.escape(begin)}*"))
    others = [path for path in states if path not in own]
    if others:
        raise NacreError(
            f"{others[0]}: something else was stopped here, an encoding or another model; name "
            f"another output, or remove {begin}* to begin anew"
        )
    if states and not resume:
        raise NacreError(
            f"{states[0]}: a training was stopped here; add --resume to go on, or remove {begin}* "
            "to begin anew"
        )
