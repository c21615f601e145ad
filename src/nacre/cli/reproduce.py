"""`nacre reproduce`."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from nacre.cli.console import Stages, console, environment_option, file_path, print_facts
from nacre.cli.ranges import SEED
from nacre.cli.reproduce_btf import EXPERIMENTS as _TEXTURES
from nacre.cli.reproduce_btf import command as texture_command
from nacre.cli.reproduction import list_option, output_option, print_reproduced, split_names
from nacre.errors import NacreError

if TYPE_CHECKING:
    from nacre.latent import LatentBasis
    from nacre.reproduce import Method, Settings
    from nacre.reproduce.codes import CodeSettings

_NOISE = ("fig13", "fig14", "fig15", "fig16")
_CODES = ("fig11", "fig12")
_EXPERIMENTS = (
    *("table1", "table2", "table3"),
    *("fig6", "fig7", "fig8", "fig9", "fig10", *_CODES, *_NOISE, "fig17"),
)
_CODE_FIGURE = ("methods", "published", "environment", "size", "epochs", "cache", "fresh", "jobs")
_FOREIGN = {
    "table2": ("published", "basis", "epochs"),
    "fig11": (*_CODE_FIGURE, "quick"),
    "fig12": (*_CODE_FIGURE, "seed"),
    **dict.fromkeys(_NOISE, ("published", "environment", "size", "epochs", "jobs")),
}
"""Options that are not for an experiment."""


class _Command(click.Command):
    """Hands over to another command, with options of its own, for experiments on textures."""

    def make_context(
        self,
        info_name: str | None,
        args: list[str],
        parent: click.Context | None = None,
        **extra: Any,
    ) -> click.Context:
        """See click."""
        if any(arg in _TEXTURES for arg in args):
            return texture_command.make_context(info_name, args, parent, **extra)
        return super().make_context(info_name, args, parent, **extra)


def _print_names() -> None:
    """Print every method."""
    from nacre.reproduce import Settings, methods
    from nacre.reproduce.codes import CODES
    from nacre.reproduce.samplers import SAMPLERS

    print_facts("experiments", [("", ", ".join(_EXPERIMENTS)), ("textures", ", ".join(_TEXTURES))])
    print_facts("methods", [(name, m.about) for name, m in methods(Settings()).items()])
    print_facts("codes of table2", [(name, code.about) for name, code in CODES.items()])
    console.print(f"\nsamplers of {', '.join(_NOISE)}: {', '.join(SAMPLERS)}", markup=False)


@click.command("reproduce", cls=_Command)
@click.argument("experiment", type=click.Choice((*_EXPERIMENTS, *_TEXTURES)))
@click.argument("files", nargs=-1, required=True, type=file_path())
@output_option
@click.option(
    "--methods",
    "chosen",
    metavar="NAME,NAME",
    help="What to compare: methods, codes of table2, or samplers of figures 13 to 16. Default: all "
    "that belong.",
)
@list_option(_print_names)
@click.option(
    "--published",
    type=file_path(),
    multiple=True,
    help="Folder of published networks, MATERIAL.h5 each. May be given several times.",
)
@click.option(
    "--basis",
    type=file_path(),
    help="Made by nacre latent train of other materials: principal components for the method pca; "
    "any for figures 11 and 12, a neural one for samplers that are predicted, in place of the one "
    "that comes with nacre.",
)
@environment_option
@click.option("--size", type=click.IntRange(16, 1024), default=128, help="Pixels of the spheres.")
@click.option("--epochs", type=click.IntRange(1), default=100, help="Of networks.")
@click.option("--quick", is_flag=True, help="Small pictures and short fits: figures to look at.")
@click.option("--seed", type=SEED, default=0, help="Of fits.")
@click.option("--cache", type=file_path(), help="Finished trials. Default: OUTPUT/cache.")
@click.option("--fresh", is_flag=True, help="Make trials again that are in the cache.")
@click.option("--jobs", type=click.IntRange(1), help="Materials at a time. Default: one a core.")
def command(
    experiment: str,
    files: tuple[Path, ...],
    output: Path,
    chosen: str | None,
    published: tuple[Path, ...],
    basis: Path | None,
    environment: Path | None,
    size: int,
    epochs: int,
    quick: bool,
    seed: int,
    cache: Path | None,
    fresh: bool,
    jobs: int | None,
) -> None:
    """Make a table or figure of the NBRDF paper again from the materials in FILES.

    Every pair of a material and a method is tried once and kept: a run that was stopped goes on,
    and other experiments on the same materials find what they need.

    Those of the paper on textures have options of their own: nacre reproduce btf-table1 --help.
    """
    from nacre.errors import require
    from nacre.render.environment import load_environment
    from nacre.reproduce import EXPERIMENTS, Settings, methods, run
    from nacre.reproduce.cache import Cache
    from nacre.reproduce.methods import TRUTH

    require("matplotlib.figure", "plot")
    _refuse_foreign(experiment)
    kept = cache or output / "cache"
    if experiment in _CODES:
        _of_codes(experiment, files, output, basis, quick, seed)
        return
    if experiment in _NOISE:
        _noise(experiment, files, output, chosen, basis, quick, seed, kept, fresh)
        return
    for folder in published:
        if not folder.is_dir():
            raise NacreError(
                f"{folder}: is no folder; --published takes the folder of the networks"
            )
    lighting = load_environment(environment) if environment else None
    settings = Settings(size=size, epochs=epochs, seed=seed, environment=lighting)
    if quick:
        settings = replace(settings, size=64, directions=128, epochs=20, samples=160_000)
    known = methods(settings, published, basis)
    if experiment == "table2":
        files, codes, settings = _codes(files, chosen, settings, quick, kept, fresh)
        known = {TRUTH: known[TRUTH], **codes}
    kind = EXPERIMENTS[experiment]
    names = _names(chosen, known) if chosen else kind.choose(known)
    if kind.anisotropic:
        _check_anisotropic(files, experiment)
    output.mkdir(parents=True, exist_ok=True)
    with Stages() as stages:
        report = stages.add(experiment)
        study = run(
            files,
            {name: known[name] for name in (TRUTH, *names)},
            settings,
            Cache(kept),
            jobs=jobs,
            fresh=fresh,
            progress=report,
        )
        if not any(method != TRUTH for _, method in study.trials):
            reasons = sorted(set(study.skipped.values()))
            raise NacreError(f"nothing could be tried: {'; '.join(reasons)}")
        paths = kind.write(experiment, study, names, output, report)
    print_reproduced(paths, kind.differs, study.left_out())


def _refuse_foreign(experiment: str) -> None:
    """Raise if an option is given that is not for the experiment."""
    context = click.get_current_context()
    for parameter in context.command.params:
        option = max(parameter.opts, key=len)
        given = context.get_parameter_source(parameter.name or "") != ParameterSource.DEFAULT
        if given and option.removeprefix("--") in _FOREIGN.get(experiment, ()):
            raise click.BadParameter(f"{option} is not for {experiment}")


def _codes(
    files: tuple[Path, ...],
    chosen: str | None,
    settings: Settings,
    quick: bool,
    folder: Path,
    fresh: bool,
) -> tuple[tuple[Path, ...], dict[str, Method], CodeSettings]:
    """What Table 2 tries: held-out materials, codes by bases of the others, settings."""
    from nacre.reproduce.codes import CODES, CodeSettings, code_methods

    names = _names(chosen, CODES) if chosen else list(CODES)
    shared = CodeSettings(
        **{field.name: getattr(settings, field.name) for field in fields(settings)}
    )
    if quick:
        shared = replace(shared, steps=500, mixtures=60)
    with Stages() as stages:
        held_out, codes, shared = code_methods(
            files, names, shared, folder, stages.add("table2"), fresh=fresh
        )
    return tuple(held_out), codes, shared


def _of_codes(
    experiment: str,
    files: tuple[Path, ...],
    output: Path,
    basis_path: Path | None,
    quick: bool,
    seed: int,
) -> None:
    """Figures 11 and 12, which show codes and compare nothing."""
    from nacre.figures.plot import write_plot
    from nacre.reproduce.code_figures import MAP_DIFFERS, ROWS_DIFFER, map_page, row_page

    basis, path = _basis(basis_path), output / f"{experiment}.png"
    output.mkdir(parents=True, exist_ok=True)
    with Stages() as stages:
        report = stages.add(experiment)
        if experiment == "fig11":
            page, ringed = map_page(files, basis, seed, report)
            note, differs = f", {ringed} that the basis was not trained on", MAP_DIFFERS
        else:
            page = row_page(files, basis, *((64, 16) if quick else (192, 64)), report)
            note, differs = "", ROWS_DIFFER
    write_plot(page, path)
    print_reproduced([f"{path}: {len(files)} materials{note}"], differs)


def _basis(path: Path | None) -> LatentBasis:
    """The basis that codes are of: that in a file, or the one that comes with nacre."""
    from nacre.latent import find_basis

    return find_basis(str(path or "neural"))


def _noise(
    experiment: str,
    files: tuple[Path, ...],
    output: Path,
    chosen: str | None,
    basis_path: Path | None,
    quick: bool,
    seed: int,
    cache: Path,
    fresh: bool,
) -> None:
    """The figures of noise, which compare samplers and not representations."""
    from nacre.formats import load_brdf
    from nacre.reproduce.noise import NoiseSettings
    from nacre.reproduce.noise_experiments import DIFFERS, NOISE_EXPERIMENTS
    from nacre.reproduce.samplers import DEFAULT, PREDICTED, SAMPLERS

    basis = _predicting(basis_path)
    if chosen:
        names = _names(chosen, SAMPLERS)
    else:  # codes are for isotropic materials
        coded = all(load_brdf(path).isotropic for path in files)
        names = [name for name in DEFAULT if coded or name not in PREDICTED]
    settings = NoiseSettings(seed=seed)
    if quick:
        settings = replace(settings, size=(180, 120), counts=(1, 4, 16, 64), reference=512)
    kind = NOISE_EXPERIMENTS[experiment]
    output.mkdir(parents=True, exist_ok=True)
    with Stages() as stages:
        study = kind.run(
            files, names, settings, cache, stages.add(experiment), basis=basis, fresh=fresh
        )
    print_reproduced(kind.write(experiment, study, names, files, output), DIFFERS)


def _predicting(path: Path | None) -> LatentBasis:
    """A basis that predicts lobes."""
    basis = _basis(path)
    if not basis.predictors:
        raise NacreError(f"{path}: predicts no lobes; make it by nacre latent train --model neural")
    return basis


def _names(chosen: str, known: Container[str]) -> list[str]:
    """Names of methods with commas between them."""
    names = split_names(chosen)
    for name in names:
        if name not in known or name == "truth":
            raise click.BadParameter(f"--methods: {name!r} is no method; --list prints them")
    return names


def _check_anisotropic(files: tuple[Path, ...], experiment: str) -> None:
    """Raise if a material is isotropic."""
    from nacre.formats import load_brdf

    for path in files:
        if load_brdf(path).isotropic:
            raise NacreError(f"{path}: is isotropic; {experiment} is of anisotropic materials")
