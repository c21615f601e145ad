"""`nacre reproduce btf-...`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.progress import progress
from nacre.cli.report import print_facts
from nacre.cli.reproduction import list_option, output_option, print_reproduced, split_names

EXPERIMENTS = ("btf-table1", "btf-fig4", "btf-fig5", "btf-fig6", "btf-fig7", "btf-fig8", "btf-tsne")
_QUICK_TEXELS = 48
"""Of each texture at which errors are found, if it should be quick."""


def _print_names() -> None:
    """Print every experiment and method."""
    from nacre.reproduce.textures.experiments import EXPERIMENTS as KNOWN
    from nacre.reproduce.textures.methods import KINDS

    print_facts("experiments", [(name, kind.title) for name, kind in KNOWN.items()])
    print_facts("methods", [(f"{name}-VALUES", kind.about) for name, kind in KINDS.items()])


@make("reproduce", writes=True, reports=True)
@click.argument("experiment", type=click.Choice(EXPERIMENTS))
@options.inputs_argument("textures", metavar="INPUT...")
@output_option()
@options.option(
    "--methods",
    "chosen",
    metavar="NAME,NAME",
    show_default="what the paper compares, and nacre's own",
    help="Methods to compare, like unified-32.",
)
@list_option(_print_names)
@options.option(
    "--unseen",
    multiple=True,
    metavar="NAME",
    show_default="all whose names end in 12",
    help="Texture to keep from training. May be repeated.",
)
@options.option(
    "--other",
    type=options.INPUT,
    multiple=True,
    help="Folder or file of further unseen textures for btf-fig6, of any directions. May be "
    "repeated.",
)
@options.option(
    "--again",
    type=options.INPUT,
    help="Folder of second measurements for btf-table1, with other noise and the same names.",
)
@options.option(
    "--minutes",
    type=options.FiniteRange(0.0, 1e6, min_open=True),
    show_default="10",
    help="Length of the training of each network.",
)
@options.option("--quick", is_flag=True, help="Train shortly on few texels: figures to look at.")
@options.seed_option()
@options.option(
    "--cache",
    type=options.OUTPUT,
    show_default="OUTPUT/cache",
    help="Folder of codecs and results.",
)
@options.option("--fresh", is_flag=True, help="Make again what is in the cache.")
def command(
    experiment: str,
    textures: tuple[Path, ...],
    output: Path,
    chosen: str | None,
    unseen: tuple[str, ...],
    other: tuple[Path, ...],
    again: Path | None,
    minutes: float | None,
    quick: bool,
    seed: int,
    cache: Path | None,
    fresh: bool,
) -> None:
    """Make a table or figure of "Unified Neural Encoding of BTFs" again.

    INPUT are files, or folders of some, all measured at the same pairs of directions. Codecs are
    found or trained on those that are not kept unseen. What is made is kept: a run that was stopped
    goes on, and other experiments on the same textures find what they need.
    """
    from nacre.errors import require
    from nacre.reproduce.textures.experiments import EXPERIMENTS as KNOWN
    from nacre.reproduce.textures.materials import collect, separate
    from nacre.reproduce.textures.methods import TrainingSettings, find
    from nacre.reproduce.textures.study import Study

    require("matplotlib.figure", "plot")
    if other and experiment != "btf-fig6":
        raise click.BadParameter(f"--other is not for {experiment}")
    if again and experiment != "btf-table1":
        raise click.BadParameter(f"--again is not for {experiment}")
    kind = KNOWN[experiment]
    methods = [find(name) for name in (split_names(chosen) if chosen else kind.methods)]
    settings = TrainingSettings.quick(seed) if quick else TrainingSettings(seed=seed)
    if minutes is not None:
        settings = replace(settings, minutes=minutes)
    training, kept = separate(collect(textures), unseen)
    output.mkdir(parents=True, exist_ok=True)
    study = Study(
        training,
        kept,
        settings,
        cache or output / "cache",
        others=collect(other),
        again=collect([again]) if again else (),
        texels=_QUICK_TEXELS if quick else None,
        fresh=fresh,
        progress=progress(experiment),
    )
    paths = kind.run(experiment, study, methods, output)
    print_reproduced(paths, kind.differs, study.left_out())
