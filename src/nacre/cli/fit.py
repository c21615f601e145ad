"""`nacre fit`."""

from __future__ import annotations

import threading
import time
from concurrent.futures import ThreadPoolExecutor, wait
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from nacre.cli.console import (
    Stages,
    check_outputs,
    console,
    file_path,
    numbers,
    preset_option,
    raise_all,
)
from nacre.cli.ranges import SEED, FiniteRange

if TYPE_CHECKING:
    from nacre.analytic import AnalyticBrdf
    from nacre.workflows.submission import Data


def _widths(context: click.Context, parameter: click.Parameter, value: str) -> tuple[int, ...]:
    widths = numbers(context, parameter, value) or ()
    if not all(1 <= width <= 1024 for width in widths):
        raise click.BadParameter("expected up to 8 widths from 1 to 1024, like 21,21")
    return widths


def _targets(files: tuple[Path, ...], output: Path | None, ending: str) -> dict[Path, Path]:
    """Where each file's material goes; makes the folder that a lone name without ending means."""
    if output and len(files) == 1 and output.suffix and not output.is_dir():
        return {files[0]: output}
    if output and output.suffix and not output.is_dir():
        raise click.BadParameter(f"{output} must be a folder for several files")
    folder = output or Path()
    folder.mkdir(parents=True, exist_ok=True)
    targets = {path: folder / f"{path.stem}{ending}" for path in files}
    if len(set(targets.values())) < len(files):
        raise click.BadParameter("two files would be written to the same name")
    return targets


def _model(
    _context: click.Context, _parameter: click.Parameter, value: str
) -> type[AnalyticBrdf] | None:
    """The class of an analytic model; None for a network."""
    from nacre.analytic import MODELS

    if value != "nbrdf" and value not in MODELS:
        raise click.BadParameter(f"{value!r} is not one of nbrdf, {', '.join(MODELS)}")
    return MODELS.get(value)


def _analytic_settings(context: click.Context, gain: float | None) -> dict[str, Any]:
    """Settings of an analytic fit; refuses options that only a network has."""
    for name in ("inputs", "hidden", "size", "precision", "epochs", "preset", "sampling", "device"):
        if context.get_parameter_source(name) != ParameterSource.DEFAULT:
            raise click.BadParameter(f"--{name} is for networks, not analytic models")
    settings = {"gain": gain, "samples": context.params["samples"], "seed": context.params["seed"]}
    return {key: value for key, value in settings.items() if value is not None}


def _validation(quality: dict[str, Any]) -> str:
    """A line on the held-out samples of a scan; empty for any other material."""
    if "held_out_samples" not in quality:
        return ""
    errors = (
        f"median {100 * quality[f'{who}_median_error']:.1f} %, "
        f"mean {100 * quality[f'{who}_mean_error']:.1f} %"
        for who in ("held_out", "nearest_sample")
    )
    return (
        f"\n  relative error at {quality['held_out_samples']} held-out samples: {next(errors)} "
        f"(of the nearest sample: {next(errors)})"
    )


@click.command("fit")
@click.argument("files", nargs=-1, required=True, type=file_path())
@click.option(
    "-o",
    "--output",
    "--out",
    type=file_path(),
    help="File to write (.safetensors or .h5; .json of an analytic model), or a folder. "
    "Default: MATERIAL.safetensors or .json here.",
)
@click.option(
    "--model",
    default="nbrdf",
    callback=_model,
    metavar="NAME",
    help="nbrdf, or an analytic model: ggx, ggx-anisotropic, ... An unknown name lists them all.",
)
@click.option(
    "--gain",
    type=FiniteRange(0.0, 1e6, min_open=True),
    help="Of the loss: more than 1 gives more weight to what is dark. Default: 1, and 32 of a "
    "network with enhanced inputs.",
)
@click.option(
    "--inputs",
    default="paper",
    type=click.Choice(["paper", "enhanced", "stereographic"]),
    help="What the network sees: the paper's vectors, which its authors' tools read, or stretched "
    "angles, which come closer at the same size, or light and view as networks for textures do, "
    "for comparison: highlights blur.",
)
@click.option(
    "--hidden",
    default="21,21",
    callback=_widths,
    metavar="N,N",
    help="Widths of the hidden layers.",
)
@click.option(
    "--size",
    type=click.IntRange(64, 1 << 20),
    metavar="BYTES",
    help="Bytes that the weights may take, in place of --hidden: two hidden layers as wide as "
    "they allow.",
)
@click.option(
    "--precision",
    type=click.Choice(["single", "half"]),
    help="How weights are stored: 4 or 2 bytes each. Default: single, and half with enhanced "
    "inputs.",
)
@preset_option
@click.option(
    "--epochs", type=click.IntRange(1), help="Passes over the samples, in place of the preset's."
)
@click.option(
    "--samples",
    type=click.IntRange(1000, 100_000_000),
    help="Samples drawn. Default: 800000, or 4000000 for an anisotropic material or "
    "stereographic inputs, and an eighth of that for a draft; 40000 for an analytic model.",
)
@click.option(
    "--sampling",
    default="mixed",
    type=click.Choice(["mixed", "rusinkiewicz", "hemisphere"]),
    help="How training directions are distributed: uniform in the Rusinkiewicz angles, dense about "
    "highlights, as in the paper; over the solid angle; or half the first and half as pictures "
    "show them.",
)
@click.option("--seed", default=0, type=SEED, help="Same seed, same file.")
@click.option("--jobs", type=click.IntRange(1), help="Materials at a time. Default: one a core.")
@click.option(
    "--device",
    help="Fit in PyTorch on this device (cpu, cuda) in place of the compiled CPU kernel; of a "
    "folder, all materials as one batch.",
)
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Fit folders on a Dask cluster (extra: cluster): tcp://HOST:8786, or local for processes "
    "on this machine. See docs/cluster.md.",
)
@click.option(
    "--data",
    default="auto",
    type=click.Choice(["auto", "path", "content"]),
    help="How a cluster comes by measured files: by the same path, by their content, which is "
    "sent, or by content where a worker has another file under the path, or none.",
)
@click.pass_context
def command(
    context: click.Context,
    files: tuple[Path, ...],
    output: Path | None,
    model: type[AnalyticBrdf] | None,
    gain: float | None,
    inputs: str,
    hidden: tuple[int, ...],
    size: int | None,
    precision: str | None,
    preset: str,
    epochs: int | None,
    samples: int | None,
    sampling: str,
    seed: int,
    jobs: int | None,
    device: str | None,
    scheduler: str | None,
    data: Data,
) -> None:
    """Fit a neural material, or an analytic model, to each measured file.

    Of a folder, every measured file in it and below is fitted, into a folder with a manifest: a
    later run fits only what has changed.
    """
    from nacre import analytic
    from nacre.formats import check_target, load_brdf, save, target
    from nacre.neural import Recipe, fit
    from nacre.runtime.parallel import core_count, one_blas_thread

    settings = _analytic_settings(context, gain) if model else {}
    if size is not None and context.get_parameter_source("hidden") != ParameterSource.DEFAULT:
        raise click.UsageError("--size and --hidden exclude one another")
    recipe = Recipe.preset(
        preset,
        **({} if epochs is None else {"epochs": epochs}),
        hidden=hidden,
        size=size,
        precision=precision,
        samples=samples,
        seed=seed,
        inputs=inputs,
        gain=gain,
        sampling=sampling,
    )
    if any(path.is_dir() for path in files):
        from nacre.cli.library import executor, fit_folders
        from nacre.workflows import AnalyticFitting, NetworkFitting

        fitting = AnalyticFitting(model, settings) if model else NetworkFitting(recipe, device)
        fit_folders(files, output, fitting, executor(scheduler, data, jobs, device))
        return
    if scheduler is not None:
        raise click.UsageError("--scheduler is for folders")
    targets = _targets(files, output, ".json" if model else ".safetensors")
    for path in targets.values():
        entry, kind = target(path), "analytic" if model else "neural"
        if entry.holds not in ("", kind):
            raise click.BadParameter(f"{path}: {entry.name} files do not hold {kind} materials")
        if inputs != "paper" and entry.extensions == (".h5", ".hdf5"):
            raise click.BadParameter(f"{path}: {entry.name} files hold the paper's inputs only")
    check_outputs(targets.values(), files)
    interrupted = threading.Event()

    workers = ThreadPoolExecutor(min(jobs or core_count(), len(files)))
    with one_blas_thread(), Stages() as stages, workers as pool:
        reports = {path: stages.add(path.stem) for path in files}

        def run(path: Path) -> str:
            def report(stage: str, done: int, total: int, note: str) -> None:
                if interrupted.is_set():
                    raise click.Abort
                reports[path](stage, done, total, note)

            brdf = load_brdf(path)
            check_target(targets[path], brdf)
            start = time.perf_counter()
            if model:
                fitted = analytic.fit(brdf, model, progress=report, **settings)
                save(fitted, targets[path])
                seconds = time.perf_counter() - start
                loss = fitted.metadata["fit"]["loss"]
                return f"{targets[path]}: {fitted.summary()}, loss {loss:.5f}, {seconds:.1f} s"
            network = fit(brdf, recipe, device=device, progress=report)
            seconds = time.perf_counter() - start
            save(network, targets[path])
            quality = network.metadata["quality"]
            memory = f"{network.weight_count} weights ({network.nbytes:,} bytes)"
            line = f"{targets[path]}: {memory}, held-out loss {quality['held_out_loss']:.5f}"
            return f"{line}, {seconds:.1f} s{_validation(quality)}"

        results = [pool.submit(run, path) for path in files]
        try:
            wait(results)
        except KeyboardInterrupt:
            interrupted.set()
            pool.shutdown(cancel_futures=True)
            raise

    failures = [error for result in results if (error := result.exception())]
    for result in results:
        if not result.exception():
            console.print(result.result(), markup=False)
    raise_all(failures)
