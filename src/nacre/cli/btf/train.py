"""`nacre btf train`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from nacre.cli.btf.kinds import expect
from nacre.cli.btf.options import pixels_option
from nacre.cli.console import Stages, console, counted, file_path
from nacre.cli.ranges import SEED, FiniteRange

_OPTIONS = {"recipe_name": "--recipe"}
"""Options that are not called as their parameters are."""


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

    Beside the output it keeps its state (OUTPUT.state, of basis OUTPUT.state.*.state) until it is
    done, from which --resume goes on: after Ctrl-C nothing is lost, and a minute at most when it is
    killed. Of unified and custom there is a table of the losses too, OUTPUT.journal.csv, which
    stays, and several processes train together where torchrun starts them:
    torchrun --nproc-per-node 2 -m nacre btf train ...
    """
    from nacre.runtime.progress import silent
    from nacre.workflows.codec_training import (
        is_first_process,
        kinds_with,
        train_codec,
    )

    for path in files:
        expect(path, "a texture", "an encoded texture")
    settings: dict[str, Any] = {}
    for option, (name, value) in {
        "recipe_name": ("preset", recipe_name),
        "minutes": ("minutes", minutes),
        "steps": ("steps", steps),
        "latent": ("code_dim", latent),
        "pooling": ("pooling", pooling),
        "decoder": ("decoder", decoder),
        "loss": ("loss", loss),
        "batch": ("batch", batch),
        "learning_rate": ("learning_rate", learning_rate),
        "patience": ("patience", patience),
        "bfloat16": ("precision", "bfloat16" if bfloat16 else None),
        "device": ("device", device),
        "seed": ("seed", seed),
    }.items():
        if context.get_parameter_source(option) is ParameterSource.COMMANDLINE:
            kinds = kinds_with(name)
            if model not in kinds:
                shown = _OPTIONS.get(option, f"--{option.replace('_', '-')}")
                raise click.BadParameter(f"{shown} is for --model {' and '.join(kinds)}")
            settings[name] = value
    with Stages() as stages:
        found = train_codec(
            files,
            output,
            model=model,
            pixels=pixels,
            half=half,
            resume=resume,
            events=events,
            progress=stages.add(output.stem) if is_first_process() else silent,
            **settings,
        )
    if found is None:
        return
    codec, facts = found.codec, []
    if "steps" in codec.metadata:
        facts.append(counted(codec.metadata["steps"], "step", "steps"))
    facts.append(counted(codec.code_dim, "value a code", "values a code"))
    if codec.metadata.get("held out") is not None:
        facts.append(f"loss on held-out texels {codec.metadata['held out']:.4f}")
    console.print(f"{output}: {', '.join(facts)}, {found.nbytes:,} bytes", markup=False)
