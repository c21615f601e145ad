"""`nacre reproduce`."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from nacre.cli.console import (
    Stages,
    console,
    environment_option,
    file_path,
    print_facts,
    status,
)
from nacre.cli.ranges import SEED, FiniteRange
from nacre.errors import printable

_FIELDS = {"cache": "folder"}
"""Names of options that are called otherwise in :class:`nacre.reproduce.experiment.Request`."""
_ALWAYS = frozenset(("experiment", "files", "output"))


def _list(context: click.Context, _parameter: click.Parameter, value: bool) -> None:
    """Print every experiment and method, and stop."""
    if not value:
        return
    from nacre.reproduce import EXPERIMENTS
    from nacre.reproduce.codes import CODES
    from nacre.reproduce.methods import methods
    from nacre.reproduce.samplers import SAMPLERS
    from nacre.reproduce.textures.methods import KINDS
    from nacre.reproduce.trial import Settings

    print_facts("experiments", [(name, kind.title) for name, kind in EXPERIMENTS.members()])
    print_facts("methods", [(name, m.about) for name, m in methods(Settings()).items()])
    print_facts("codes of table2", [(name, code.about) for name, code in CODES.items()])
    print_facts("methods of btf-...", [(f"{name}-SIZE", k.about) for name, k in KINDS.items()])
    console.print(f"\nsamplers of figures 13 to 16: {', '.join(SAMPLERS)}", markup=False)
    context.exit()


def _names(_context: click.Context, _parameter: click.Parameter, value: str | None) -> list[str]:
    """Distinct names with commas between them, in order."""
    return list(dict.fromkeys(part.strip() for part in (value or "").split(",") if part.strip()))


@click.command("reproduce")
@click.argument("experiment")
@click.argument("files", nargs=-1, required=True, type=file_path())
@click.option(
    "-o",
    "--output",
    type=file_path(),
    default="reproduced",
    help="Folder for the CSV, the Markdown table and the pictures.",
)
@click.option(
    "--methods",
    callback=_names,
    metavar="NAME,NAME",
    help="What to compare: methods, codes of table2, samplers of figures 13 to 16, or codecs of "
    "textures like unified-32. Default: what the paper compares, and nacre's own.",
)
@click.option(
    "--list",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_list,
    help="Print the names of all experiments and methods.",
)
@click.option(
    "--published",
    type=file_path(),
    multiple=True,
    help="Folder of published networks, MATERIAL.h5 each. May be given several times.",
)
@click.option(
    "--basis",
    type=file_path(),
    help="Basis made by nacre latent train: principal components for the method pca; any for "
    "figures 11 and 12, a neural one for figures 13 to 16, in place of the pretrained one.",
)
@environment_option
@click.option("--size", type=click.IntRange(16, 1024), default=128, help="Pixels of the spheres.")
@click.option("--epochs", type=click.IntRange(1), default=100, help="Epochs of each training.")
@click.option(
    "--minutes",
    type=FiniteRange(0.0, 1e6, min_open=True),
    help="Minutes of training each network of btf-...  [default: 10]",
)
@click.option(
    "--unseen",
    multiple=True,
    metavar="NAME",
    help="Texture to keep from the training of btf-... May be given several times. Default: all "
    "whose names end in 12.",
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
@click.option("--quick", is_flag=True, help="Small pictures and short fits: figures to look at.")
@click.option("--seed", type=SEED, default=0, help="Seed of fits and of samples.")
@click.option("--cache", type=file_path(), help="Folder of results kept. Default: OUTPUT/cache.")
@click.option("--fresh", is_flag=True, help="Make again what is in the cache.")
@click.option("--jobs", type=click.IntRange(1), help="Materials at a time. Default: one a core.")
def command(
    experiment: str, files: tuple[Path, ...], output: Path, cache: Path | None, **options: Any
) -> None:
    """Make a table or figure of a paper again from the materials in FILES.

    EXPERIMENT is one that --list prints: of the NBRDF paper, like table1 or fig6, or of "Unified
    Neural Encoding of BTFs", like btf-table1. For the latter FILES are textures, or folders of
    some, all measured at the same pairs of directions; codecs are trained on those that are not
    kept unseen.

    Every pair of a material and a method is tried once and kept: a run that was stopped goes on,
    and other experiments on the same materials find what they need.
    """
    from nacre.reproduce import EXPERIMENTS
    from nacre.reproduce.experiment import Request, reproduce

    kind = EXPERIMENTS.find(experiment)
    _refuse_unheeded(experiment, kind.heeds)
    with Stages() as stages:
        report = stages.add(experiment)
        request = Request(files, cache or output / "cache", progress=report, **options)
        paths, outcome = reproduce(kind, experiment, request, output)
    for method, reason, materials in outcome.left_out:
        line = f"left out: {method} ({', '.join(materials)}): {reason}"
        status.print(printable(line), markup=False)
    _print(f"{path}: {outcome.note}" if outcome.note else path for path in paths)
    _print([f"differs from the paper: {kind.differs}"])


def _print(lines: Iterable[object]) -> None:
    for line in lines:
        console.print(printable(str(line)), markup=False)


def _refuse_unheeded(experiment: str, heeded: frozenset[str]) -> None:
    """Raise if an option is given that the experiment does not heed."""
    context = click.get_current_context()
    for parameter in context.command.params:
        name = parameter.name or ""
        given = context.get_parameter_source(name) != ParameterSource.DEFAULT
        if given and _FIELDS.get(name, name) not in heeded | _ALWAYS:
            option = max(parameter.opts, key=len)
            raise click.BadParameter(f"{option} is not for {experiment}")
