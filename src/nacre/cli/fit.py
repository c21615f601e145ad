"""`nacre fit`."""

from __future__ import annotations

import threading
import time
from concurrent.futures import ThreadPoolExecutor, wait
from pathlib import Path

import click

from nacre.cli.console import Stages, check_outputs, console, file_path, numbers, printable


def _widths(context: click.Context, parameter: click.Parameter, value: str) -> tuple[int, ...]:
    widths = numbers(context, parameter, value) or ()
    if not all(1 <= width <= 1024 for width in widths):
        raise click.BadParameter("expected up to 8 widths from 1 to 1024, like 21,21")
    return widths


def _targets(files: tuple[Path, ...], output: Path | None) -> dict[Path, Path]:
    """Where each file's material goes; makes the folder that a lone name without ending means."""
    if output and len(files) == 1 and output.suffix and not output.is_dir():
        return {files[0]: output}
    if output and output.suffix and not output.is_dir():
        raise click.BadParameter(f"{output} must be a folder for several files")
    folder = output or Path()
    folder.mkdir(parents=True, exist_ok=True)
    targets = {path: folder / f"{path.stem}.safetensors" for path in files}
    if len(set(targets.values())) < len(files):
        raise click.BadParameter("two files would be written to the same name")
    return targets


@click.command("fit")
@click.argument("files", nargs=-1, required=True, type=file_path())
@click.option(
    "-o",
    "--output",
    type=file_path(),
    help="File to write (.safetensors or .h5), or a folder. Default: MATERIAL.safetensors here.",
)
@click.option(
    "--hidden",
    default="21,21",
    callback=_widths,
    metavar="N,N",
    help="Widths of the hidden layers.",
)
@click.option("--epochs", default=100, type=click.IntRange(1), help="Passes over the samples.")
@click.option("--draft", is_flag=True, help="Quick look: a fifth of the epochs.")
@click.option(
    "--samples",
    type=click.IntRange(1000, 100_000_000),
    help="Samples drawn. Default: 800000, or 4000000 for an anisotropic material.",
)
@click.option("--seed", default=0, type=click.IntRange(0), help="Same seed, same file.")
@click.option("--jobs", type=click.IntRange(1), help="Materials at a time. Default: one a core.")
@click.option(
    "--device",
    help="Fit in PyTorch on this device (cpu, cuda) in place of the compiled CPU kernel.",
)
def command(
    files: tuple[Path, ...],
    output: Path | None,
    hidden: tuple[int, ...],
    epochs: int,
    draft: bool,
    samples: int | None,
    seed: int,
    jobs: int | None,
    device: str | None,
) -> None:
    """Fit a neural material to each measured file."""
    from nacre.formats import check_target, load, save, target
    from nacre.neural import Recipe, fit
    from nacre.parallel import core_count, one_blas_thread

    targets = _targets(files, output)
    for path in targets.values():
        target(path)
    check_outputs(targets.values(), files)
    epochs = max(1, epochs // 5) if draft else epochs
    recipe = Recipe(hidden=hidden, epochs=epochs, samples=samples, seed=seed)
    interrupted = threading.Event()

    workers = ThreadPoolExecutor(min(jobs or core_count(), len(files)))
    with one_blas_thread(), Stages() as stages, workers as pool:
        reports = {path: stages.add(path.stem) for path in files}

        def run(path: Path) -> str:
            def report(stage: str, done: int, total: int, note: str) -> None:
                if interrupted.is_set():
                    raise click.Abort
                reports[path](stage, done, total, note)

            brdf = load(path)
            check_target(targets[path], brdf)
            start = time.perf_counter()
            network = fit(brdf, recipe, device=device, progress=report)
            seconds = time.perf_counter() - start
            save(network, targets[path])
            loss = network.metadata["quality"]["held_out_loss"]
            size = f"{network.weight_count} weights ({4 * network.weight_count:,} bytes)"
            return f"{targets[path]}: {size}, held-out loss {loss:.5f}, {seconds:.1f} s"

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
    for failure in failures[:-1]:
        click.echo(f"nacre: {printable(str(failure))}", err=True)
    if failures:
        raise failures[-1]
