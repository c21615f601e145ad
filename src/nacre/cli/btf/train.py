from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nacre.cli import options, plans
from nacre.cli.command import command as make
from nacre.cli.options import option
from nacre.cli.ranges import IntRange, positive
from nacre.cli.report import counted, progress, report_file

if TYPE_CHECKING:
    from nacre.measured.textures.image_folder import Quantity

_TRAINING = "the training of unified and custom codecs"
_SETTINGS = {"recipe_name": "preset", "bfloat16": "precision"}
"""Settings of a training whose names differ from those of their options."""


@make(
    "train",
    options.inputs_argument(),
    options.output_option("Codec to write (.safetensors)."),
    option("--model", metavar="NAME", default="basis"),
    "Kind of codec. basis: nacre's own, trained in minutes on textures of one set of directions, "
    "encodes any. unified: any directions (Rainer et al. 2020). custom: one set of directions, for "
    "one texture (Rainer et al. 2019).",
    option("--code-dim", IntRange(1, 1024), shown="32; 8 for custom"),
    "Number of values in a code; up to 128 for basis.",
    options.precision_option(default="single", help="Precision of the stored weights."),
    option(
        "--steps",
        IntRange(1),
        shown="10,000; for unified and custom 100 epochs, or 1,000 with the reference recipe",
    ),
    "Optimizer steps; for basis, of both stages together.",
    option("--resume", is_flag=True, help="Resume the same command where it stopped."),
    options.pixels_option(),
    options.seed_option(),
    option("--pooling", ["mean", "max"], applies="codec", shown="mean"),
    "Pooling in the unified encoder.",
    option("--decoder", ["network", "bilinear"], applies="codec", default="network"),
    "Decoder: the paper's network, or coefficients of the code times features of directions.",
    option(
        "--decoder-hidden",
        options.integers("106,106,106,106", most=4096),
        applies="codec",
        shown="106,106,106,106",
    ),
    "Widths of the decoder's hidden layers.",
    option("--loss", ["l1", "l2"], applies="codec", shown="l1; l2 for custom"),
    "Loss to minimize.",
    option(
        "--recipe recipe_name",
        ["reference", "default"],
        applies="codec",
        group=_TRAINING,
        default="default",
    ),
    "Recipe: the paper's, which takes days, or ours.",
    option("--minutes", positive(1e6), applies="codec", group=_TRAINING),
    "Approximate training time, instead of --steps.",
    option("--epochs", IntRange(1), applies="codec", group=_TRAINING),
    "Epochs of 100 texels per texture, instead of --steps.",
    option(
        "--batch",
        IntRange(1),
        applies="codec",
        group=_TRAINING,
        shown="128; 32 for custom; 10 with the reference recipe",
    ),
    "Texels per step.",
    option(
        "--learning-rate",
        positive(1e3),
        applies="codec",
        group=_TRAINING,
        shown="0.01; 0.2 with the reference recipe",
    ),
    "Largest learning rate.",
    option("--patience", IntRange(0), applies="codec", group=_TRAINING, default=0),
    "Validations without improvement, 200 steps apart, to stop after; 0 for never.",
    option("--bfloat16", applies="codec", group=_TRAINING, is_flag=True),
    "Multiply matrices in bfloat16, which is fast on many processors.",
    options.device_option(applies="codec", group=_TRAINING, default="cpu"),
    "PyTorch device to train on.",
    option("--events", options.OUTPUT, applies="codec", group=_TRAINING),
    "Folder for a TensorBoard log.",
    plans=True,
)
def command(
    paths: tuple[Path, ...],
    output: Path,
    model: str,
    precision: str,
    events: Path | None,
    resume: bool,
    pixels: Quantity | None,
    **chosen: Any,
) -> None:
    """Train a codec that turns texels of textures into short codes and back.

    The default, basis, needs two or more textures with the same pairs of directions, and in all at
    least four texels per value of a code; it learns from 100 texels of each, or more
    if there are few textures.

    A stopped training keeps its state beside the output (OUTPUT.state*), from which --resume
    continues: Ctrl-C loses nothing, and a killed process at most a minute. unified and custom also
    write a table of losses, OUTPUT.journal.csv, and can train in several processes: torchrun
    --nproc-per-node 2 -m nacre btf train ...
    """
    from nacre.runtime.progress import silent
    from nacre.workflows.codec_training import is_first_process, kinds_with, train_codec

    settings: dict[str, Any] = {}
    for given, flag in options.given():
        if (name := given.name or "") not in chosen:
            continue
        setting = _SETTINGS.get(name, name)
        if model not in (kinds := kinds_with(setting)):
            raise click.BadParameter(f"{flag} is for --model {' and '.join(kinds)}")
        settings[setting] = "bfloat16" if name == "bfloat16" else chosen[name]
    if plans.is_wanted():
        told = [f"{name} {value}" for name, value in settings.items()]
        work = f"train a codec ({model}) on {counted(len(paths), 'texture', 'textures')}"
        plans.tell(paths, [(output, "")], ", ".join([work, *told]))
        return
    codec = train_codec(
        paths,
        output,
        model=model,
        pixels=pixels,
        half=precision == "half",
        resume=resume,
        events=events,
        progress=progress(output.stem) if is_first_process() else silent,
        **settings,
    )
    if codec is None:
        return
    metadata, code_dim = codec.metadata, codec.code_dim
    facts = [f"latent size {code_dim}"]
    data: dict[str, Any] = {"model": model, "code_dim": code_dim}
    if "steps" in metadata:
        facts.insert(0, counted(metadata["steps"], "step", "steps"))
        data["steps"] = metadata["steps"]
    if metadata.get("held out") is not None:
        facts.append(f"loss on held-out texels {metadata['held out']:.4f}")
        data["held_out_loss"] = metadata["held out"]
    report_file(output, ", ".join(facts), **data)
