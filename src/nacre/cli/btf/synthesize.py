from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from nacre.cli import options
from nacre.cli.btf.written import source_of, written_reference
from nacre.cli.command import command as make
from nacre.cli.kinds import expect
from nacre.cli.options import option
from nacre.cli.ranges import FiniteRange, IntRange, positive
from nacre.cli.report import progress, report_facts


@make(
    "synthesize",
    options.argument("source", metavar="CODES"),
    options.output_option("Encoded texture to write (.safetensors)."),
    options.texels_option(shown="--scale times the input's"),
    "Width and height of the output in texels.",
    option("--scale", positive(), shown="5"),
    "Edge lengths of the output relative to the input's.",
    option("--tile", is_flag=True, help="Make a texture that tiles."),
    options.seed_option(),
    option("--patch", IntRange(2), group="patches", shown="from the texture"),
    "Edge length of patches in texels.",
    option("--overlap", IntRange(1), group="patches", shown="3/8 of the patch"),
    "Overlap of patches in texels.",
    option("--tolerance", FiniteRange(0.0), group="patches", default=0.1),
    "Choose among patches whose error exceeds the smallest by at most this fraction.",
    option("--periodic/--no-periodic", group="patches", default=None, shown="as detected"),
    "Let patches cross the edges of the input, which must tile.",
)
def command(
    source: Path, output: Path, texels: tuple[int, int] | None, scale: float | None, **chosen: Any
) -> None:
    """Make a larger texture from patches of an encoded one.

    Every texel has the code of a texel of the input, so it looks right from all directions. Seams
    are judged by the differences of neighbors across them relative to all others: 1 is best.
    """
    from nacre.textures.latent_file import check_latent_path, load_latent_map, save_latent_map
    from nacre.textures.synthesis import synthesize

    if texels is not None and scale is not None:
        raise click.UsageError("expected either --texels or --scale")
    if texels is not None and min(texels) < 2:
        raise click.BadParameter("--texels: expected 2x2 or more")
    check_latent_path(output)
    options.check_outputs([output], [source])
    expect(source, "an encoded texture")
    latent = load_latent_map(source)
    rows, columns = latent.codes.shape[:2]
    factor = 5.0 if scale is None else scale
    width, height = texels or (round(factor * columns), round(factor * rows))
    began = time.monotonic()
    made = synthesize(latent, height, width, **chosen, progress=progress(output.stem))
    seconds = time.monotonic() - began
    facts = made.facts()
    metadata = {"source": source_of(source), "synthesis": facts}
    reference = written_reference(latent, source, output)
    save_latent_map(replace(made.latent, reference=reference, metadata=metadata), output)
    sizes = {"width": width, "height": height, "input width": columns, "input height": rows}
    shown = {**sizes, **facts, "seconds": seconds}
    report_facts(output.name, shown, output=str(output))
