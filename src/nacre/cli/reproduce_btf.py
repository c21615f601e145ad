"""`nacre reproduce btf-...`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from nacre.cli.console import Stages, file_path, print_facts
from nacre.cli.ranges import SEED, FiniteRange
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


@click.command("reproduce")
@click.argument("experiment", type=click.Choice(EXPERIMENTS))
@click.argument("textures", nargs=-1, required=True, type=file_path())
@output_option
@click.option(
    "--methods",
    "chosen",
    metavar="NAME,NAME",
    help="What to compare, like unified-32. Default: what the paper compares, and nacre's own.",
)
@list_option(_print_names)
@click.option(
    "--unseen",
    multiple=True,
    metavar="NAME",
    help="A texture that is kept from training. May be given several times. Default: all whose "
    "names end in 12.",
)
@click.option(
    "--other",
    type=file_path(),
    multiple=True,
    help="Folder or file of further unseen textures for btf-fig6, of any directions. May be given "
    "several times.",
)
@click.option(
    "--again",
    type=file_path(),
    help="Folder of second measurements for btf-table1, with other noise and the same names.",
)
@click.option(
    "--minutes", type=FiniteRange(0.0, 1e6, min_open=True), help="A network.  [default: 10]"
)
@click.option("--quick", is_flag=True, help="Short trainings, few texels: figures to look at.")
@click.option("--seed", type=SEED, default=0, help="Of everything random.")
@click.option("--cache", type=file_path(), help="Codecs and results. Default: OUTPUT/cache.")
@click.option("--fresh", is_flag=True, help="Make again what is in the cache.")
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

    TEXTURES are files, or folders of some, all measured at the same pairs of directions. Codecs are
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
    with Stages() as stages:
        study = Study(
            training,
            kept,
            settings,
            cache or output / "cache",
            others=collect(other),
            again=collect([again]) if again else (),
            texels=_QUICK_TEXELS if quick else None,
            fresh=fresh,
            progress=stages.add(experiment),
        )
        paths = kind.run(experiment, study, methods, output)
    print_reproduced(paths, kind.differs, study.left_out())
