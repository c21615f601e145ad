"""`nacre btf map`."""

from __future__ import annotations

from pathlib import Path

import click

from nacre.cli.btf.kinds import expect
from nacre.cli.console import check_outputs, console, counted, file_path
from nacre.cli.ranges import SEED


@click.command("map")
@click.argument("codes", nargs=-1, required=True, type=file_path())
@click.option(
    "-o", "--output", required=True, type=file_path(), help="Picture to write (.png, .svg, .pdf)."
)
@click.option("--csv", "table", type=file_path(), help="Also write a table of texels and places.")
@click.option("--save", type=file_path(), help="Also write the map (.safetensors), for --into.")
@click.option(
    "--into", type=file_path(), help="A saved map to put CODES on: what it has stays in its place."
)
@click.option(
    "--texels", default=40, type=click.IntRange(1, 1 << 16), help="Of each texture, at random."
)
@click.option("--swatches", is_flag=True, help="Show texels in their own colors.")
@click.option("--seed", default=0, type=SEED, help="Same seed, same map.")
def command(
    codes: tuple[Path, ...],
    output: Path,
    table: Path | None,
    save: Path | None,
    into: Path | None,
    texels: int,
    swatches: bool,
    seed: int,
) -> None:
    """Lay out texels of the encoded textures in CODES by t-SNE, those that look alike together.

    All must be of one model. Textures are called by their files; those whose names differ in a
    number at the end are of one family. With --into, the new ones are ringed.
    """
    from nacre.figures.plot import check_plot_path, write_plot
    from nacre.figures.texel_map import texel_map_figure, write_table
    from nacre.textures.embedding import embed_texels, load_embedding_map, save_embedding_map
    from nacre.textures.latent_file import load_latent_maps

    check_plot_path(output)
    if save is not None and save.suffix.lower() != ".safetensors":
        raise click.BadParameter(f"{save}: a map is saved as a .safetensors file")
    inputs = [*codes, *([into] if into else [])]
    check_outputs([path for path in (output, table, save) if path], inputs)
    for path in codes:
        expect(path, "an encoded texture")
    onto = load_embedding_map(into) if into is not None else None
    names = [path.stem for path in codes]
    chart = embed_texels(load_latent_maps(codes), names, texels, seed, onto)
    new = len(codes) if into is not None else 0
    write_plot(texel_map_figure(chart, new=new, own_colors=swatches), output)
    if table is not None:
        write_table(chart, table)
    if save is not None:
        save_embedding_map(chart, save)
    textures = counted(len(chart.names), "texture", "textures")
    console.print(f"{output}: {len(chart.texture):,} texels of {textures}", markup=False)
