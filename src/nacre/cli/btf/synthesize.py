"""`nacre btf synthesize`."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path

import click

from nacre.cli.btf.kinds import expect
from nacre.cli.btf.written import source_of, written_reference
from nacre.cli.console import Stages, check_outputs, file_path, print_facts, print_json
from nacre.cli.ranges import SEED, FiniteRange


@click.command("synthesize")
@click.argument("source", type=file_path())
@click.option("-o", "--output", required=True, type=file_path(), help="File (.safetensors).")
@click.option(
    "--size", nargs=2, type=click.IntRange(2), metavar="W H", help="Texels of the output."
)
@click.option("--scale", type=FiniteRange(0.0, min_open=True), help="Of its edges.  [default: 5]")
@click.option("--tile", is_flag=True, help="Make a texture that tiles.")
@click.option(
    "--patch", type=click.IntRange(2), help="Edge of patches.  [default: from the texture]"
)
@click.option("--overlap", type=click.IntRange(1), help="Of patches.  [default: 3/8 of their edge]")
@click.option(
    "--tolerance",
    default=0.1,
    show_default=True,
    type=FiniteRange(0.0),
    help="Share above the least error up to which patches are drawn from.",
)
@click.option(
    "--periodic/--bounded",
    default=None,
    help="Whether SOURCE tiles, so that patches may reach over its edges. Default: found out.",
)
@click.option("--seed", default=0, type=SEED, help="Same seed, same texture.")
@click.option("--json", "as_json", is_flag=True, help="One object, as JSON.")
def command(
    source: Path,
    output: Path,
    size: tuple[int, int] | None,
    scale: float | None,
    tile: bool,
    patch: int | None,
    overlap: int | None,
    tolerance: float,
    periodic: bool | None,
    seed: int,
    as_json: bool,
) -> None:
    """Make a larger texture like the encoded one at SOURCE, of patches of it.

    Every texel has the code of one of SOURCE, so that it looks from everywhere as that does. Seams
    are told by differences of neighbors across them, over those of all others: 1 is best.
    """
    from nacre.textures.latent_file import check_latent_path, load_latent_map, save_latent_map
    from nacre.textures.synthesis import synthesize

    if size is not None and scale is not None:
        raise click.UsageError("expected either --size or --scale")
    check_latent_path(output)
    check_outputs([output], [source])
    expect(source, "an encoded texture")
    latent = load_latent_map(source)
    rows, columns = latent.codes.shape[:2]
    factor = 5.0 if scale is None else scale
    width, height = size or (round(factor * columns), round(factor * rows))
    began = time.monotonic()
    with Stages() as stages:
        made = synthesize(
            latent,
            height,
            width,
            patch=patch,
            overlap=overlap,
            tolerance=tolerance,
            periodic=periodic,
            tile=tile,
            seed=seed,
            progress=stages.add(output.stem),
        )
    seconds = time.monotonic() - began
    facts = made.facts()
    metadata = {"source": source_of(source), "synthesis": facts}
    reference = written_reference(latent, source, output)
    save_latent_map(replace(made.latent, reference=reference, metadata=metadata), output)
    sizes = {"width": width, "height": height, "input width": columns, "input height": rows}
    report = {**sizes, **facts, "seconds": seconds}
    if as_json:
        print_json({"file": str(output), **report})
    else:
        print_facts(output.name, report.items())
