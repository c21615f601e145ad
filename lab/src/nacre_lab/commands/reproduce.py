from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.options import option
from nacre.cli.ranges import IntRange, positive
from nacre.cli.report import aside, print_facts, progress, report, say

_FIELDS: dict[str | None, str | None] = {"cache": "folder"}
"""Options with other names in :class:`nacre_lab.reproduce.experiment.Request`."""
_TRAINING, _SINGLE = "training", "single experiments on textures"
_ALWAYS = frozenset(("experiment", "files", "output"))


def _list(context: click.Context, _parameter: click.Parameter, value: bool) -> None:
    if not value or context.resilient_parsing:
        return
    from nacre_lab.reproduce import EXPERIMENTS
    from nacre_lab.reproduce.codes import CODES
    from nacre_lab.reproduce.methods import methods
    from nacre_lab.reproduce.samplers import SAMPLERS
    from nacre_lab.reproduce.textures.methods import KINDS
    from nacre_lab.reproduce.trial import Settings

    print_facts("experiments", [(name, kind.title) for name, kind in EXPERIMENTS.members()])
    print_facts("methods", [(name, m.about) for name, m in methods(Settings()).items()])
    print_facts("codes of table2", [(name, code.about) for name, code in CODES.items()])
    print_facts("methods of btf-...", [(f"{name}-SIZE", k.about) for name, k in KINDS.items()])
    say(f"\nsamplers of figures 13 to 16: {', '.join(SAMPLERS)}")
    context.exit()


@make(
    "reproduce",
    options.argument("experiment", None),
    options.inputs_argument("files"),
    options.output_option(required=False, default="reproduced"),
    "Folder for the CSV, the Markdown table and the pictures.",
    option(
        "--methods",
        callback=options.names,
        metavar="NAME,NAME",
        shown="what the paper compares, and nacre's own",
    ),
    "Methods to compare: codes for table2, samplers for fig13 to fig16, codecs such as unified-32 "
    "for textures.",
    option("--list", is_flag=True, is_eager=True, expose_value=False, callback=_list),
    "Print the names of all experiments and methods.",
    option("--published", options.INPUT, multiple=True),
    "Folder of published networks (MATERIAL.h5) or of tables of fits. May be repeated.",
    option("--basis", options.INPUT, shown="a pretrained one"),
    "Basis from nacre latent train: principal components for the method pca; any for fig11 and "
    "fig12; for fig13 to fig16, one that predicts lobes and was not trained on the materials.",
    options.environment_option(),
    option("--size", IntRange(16, 1024), shown="128; 256 for textures"),
    "Width and height of each picture in pixels.",
    option("--quick", is_flag=True, help="Make short fits and small pictures for a first look."),
    options.seed_option(),
    options.jobs_option(),
    option("--recipe", ["reference", "default"], group=_TRAINING, default="default"),
    "Training recipe for the networks of btf-...: the paper's, or ours.",
    option(
        "--steps",
        IntRange(1),
        group=_TRAINING,
        shown="3,000 for btf-...; 8,000, or 500 with --quick",
    ),
    "Training steps for each network of btf-..., or for each basis of fig13 to fig16.",
    option("--epochs", IntRange(1), group=_TRAINING, shown="100; for btf-... see --steps"),
    "Epochs of each training; for btf-..., instead of --steps.",
    option("--minutes", positive(1e6), group=_TRAINING),
    "Training time for each network of btf-... in minutes, instead of --steps.",
    options.device_option(default="cpu", group=_TRAINING),
    "PyTorch device to train the networks of btf-... on.",
    option(
        "--unseen",
        multiple=True,
        metavar="NAME",
        group=_TRAINING,
        shown="textures whose names end in 12",
    ),
    "Texture to exclude from the training of btf-..., or material to show in fig13 to fig16 and "
    "exclude from the training of predictors. May be repeated.",
    option("--other", options.INPUT, multiple=True, group=_SINGLE),
    "Folder or file of more unseen textures for btf-fig6, with any directions. May be repeated.",
    option("--height-fields", options.INPUT, group=_SINGLE),
    "Folder of height fields for btf-fig5 (NAME.exr); see nacre btf capture --height-map.",
    option("--again", options.INPUT, group=_SINGLE),
    "Folder of second measurements for btf-table1, with different noise but the same names.",
    option("--cache", options.OUTPUT, group="repeated runs", shown="OUTPUT/cache"),
    "Folder to keep results in.",
    option("--fresh", is_flag=True, group="repeated runs", help="Ignore and replace the cache."),
)
def command(
    experiment: str, files: tuple[Path, ...], output: Path, cache: Path | None, **chosen: Any
) -> None:
    """Reproduce a table or figure of a paper from given materials.

    EXPERIMENT is one that --list prints: from the NBRDF paper, such as table1 or fig6, or from
    "Unified Neural Encoding of BTFs", such as btf-table1. For the latter, INPUT are textures, or
    folders of textures, measured at the same pairs of directions; codecs are trained on those not
    excluded by --unseen.

    Every pair of a material and a method is tried once and cached: a stopped run resumes, and other
    experiments on the same materials reuse the results.
    """
    from nacre_lab.reproduce import EXPERIMENTS
    from nacre_lab.reproduce.experiment import Request, reproduce

    kind = EXPERIMENTS.find(experiment)
    _refuse_unheeded(experiment, kind.heeds)
    request = Request(files, cache or output / "cache", progress=progress(experiment), **chosen)
    paths, outcome = reproduce(kind, experiment, request, output)
    missing = []
    for method, reason, materials in outcome.left_out:
        aside(f"left out: {method} ({', '.join(materials)}): {reason}")
        missing.append({"method": method, "reason": reason, "materials": list(materials)})
    lines = [f"{path}: {outcome.note}" if outcome.note else str(path) for path in paths]
    data = {"outputs": list(map(str, paths)), "note": outcome.note, "left_out": missing}
    report([*lines, f"differs from the paper: {kind.differs}"], data | {"differs": kind.differs})


def _refuse_unheeded(experiment: str, heeded: frozenset[str]) -> None:
    """Refuse options that the experiment does not use."""
    for given, flag in options.given():
        if _FIELDS.get(given.name, given.name) not in heeded | _ALWAYS:
            raise click.BadParameter(f"{flag} is not for {experiment}")
