"""`nacre fit`."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import click

from nacre.cli.console import Stages, check_writable, console, existing_file
from nacre.files import NacreError


def _widths(_context: click.Context, _parameter: click.Parameter, value: str) -> tuple[int, ...]:
    try:
        widths = tuple(int(part) for part in value.split(","))
    except ValueError:
        widths = (0,)
    if not all(1 <= width <= 1024 for width in widths):
        raise click.BadParameter("expected widths from 1 to 1024 with commas between, like 21,21")
    return widths


@click.command("fit")
@click.argument("files", nargs=-1, required=True, type=existing_file())
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    help="File to write, or an existing folder. Default: MATERIAL.safetensors in this folder.",
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
    type=click.IntRange(1000),
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
    """Fit a neural material to each measured file and write it as .safetensors."""
    from nacre.formats import load, save, writer
    from nacre.neural import Recipe, fit
    from nacre.parallel import core_count

    if output and len(files) > 1 and not output.is_dir():
        raise click.BadParameter(f"{output} must be an existing folder for several files", None)
    folder = output if output and output.is_dir() else Path()
    targets = {
        path: output if output and not output.is_dir() else folder / f"{path.stem}.safetensors"
        for path in files
    }
    if len(set(targets.values())) < len(files):
        raise click.BadParameter("two files would be written to the same name", None)
    for target in targets.values():
        writer(target)
        check_writable(target)
    epochs = max(1, epochs // 5) if draft else epochs
    recipe = Recipe(hidden=hidden, epochs=epochs, samples=samples, seed=seed)

    with Stages() as stages:
        callbacks = {path: stages.add(path.stem) for path in files}

        def run(path: Path) -> str:
            brdf = load(path)
            start = time.perf_counter()
            network = fit(brdf, recipe, device=device, progress=callbacks[path])
            seconds = time.perf_counter() - start
            save(network, targets[path])
            loss = network.metadata["quality"]["held_out_loss"]
            size = f"{network.weight_count} weights ({4 * network.weight_count:,} bytes)"
            return f"{targets[path]}: {size}, held-out loss {loss:.5f}, {seconds:.1f} s"

        with ThreadPoolExecutor(min(jobs or core_count(), len(files))) as pool:
            results = [pool.submit(run, path) for path in files]
    failures = []
    for result in results:
        error = result.exception()
        if isinstance(error, NacreError | OSError):
            failures.append(error)
        else:
            console.print(result.result(), markup=False)
    for failure in failures[:-1]:
        click.echo(f"nacre: {failure}", err=True)
    if failures:
        raise failures[-1]
