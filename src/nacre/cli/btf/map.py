from __future__ import annotations

from pathlib import Path

import click

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.kinds import expect
from nacre.cli.options import option
from nacre.cli.ranges import IntRange
from nacre.cli.report import counted, progress, report


@make(
    "map",
    options.inputs_argument("codes", metavar="CODES..."),
    options.output_option("Plot to write (.png, .svg, .pdf)."),
    option("--table", options.OUTPUT, help="Also write a table of texels and places (.csv)."),
    option("--save", options.OUTPUT, help="Also write the map (.safetensors), for --into."),
    option("--into", options.INPUT),
    "Saved map to add CODES to; what it shows keeps its place.",
    option("--count", IntRange(1, 1 << 16), default=40),
    "Number of random texels per texture.",
    option("--colors", is_flag=True, help="Show texels in their own colors."),
    options.seed_option(),
)
def command(
    codes: tuple[Path, ...],
    output: Path,
    table: Path | None,
    save: Path | None,
    into: Path | None,
    count: int,
    colors: bool,
    seed: int,
) -> None:
    """Draw a map (t-SNE) of texels of encoded textures, similar ones close together.

    All must come from the same codec. Textures are named after their files and grouped if their
    names differ only in a number at the end. With --into, the new ones are ringed.
    """
    from nacre.figures.plot import check_plot_path, write_plot
    from nacre.figures.texel_map import texel_map_figure, write_table
    from nacre.textures.embedding import embed_texels, load_embedding_map, save_embedding_map
    from nacre.textures.latent_file import load_latent_maps

    check_plot_path(output)
    if save is not None and save.suffix.lower() != ".safetensors":
        raise click.BadParameter(f"{save}: a map is saved as a .safetensors file")
    options.check_outputs([output, table, save], [*codes, into])
    for path in codes:
        expect(path, "an encoded texture")
    progress(output.stem, "laying out texels")
    onto = load_embedding_map(into) if into is not None else None
    names = [path.stem for path in codes]
    chart = embed_texels(load_latent_maps(codes), names, count, seed, onto)
    new = len(codes) if into is not None else 0
    write_plot(texel_map_figure(chart, new=new, own_colors=colors), output)
    if save is not None:
        save_embedding_map(chart, save)
    if table is not None:  # last: a run that failed before can be repeated over its files
        write_table(chart, table)
    textures = counted(len(chart.names), "texture", "textures")
    data = {"output": str(output), "texels": len(chart.texture), "textures": len(chart.names)}
    report(f"{output}: {len(chart.texture):,} texels of {textures}", data)
