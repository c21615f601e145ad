from __future__ import annotations

from pathlib import Path

import numpy as np

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.kinds import expect
from nacre.cli.options import option
from nacre.cli.ranges import IntRange
from nacre.cli.report import print_table, progress, report


@make(
    "nearest",
    options.argument("codes"),
    options.argument("among", nargs=-1),
    options.output_option("Also write spheres of the texels (.png, .svg, .pdf).", required=False),
    option("--texel", options.TEXEL, required=True, metavar="X,Y"),
    "Texel to compare with: column and row, counted from 0.",
    option("--count", IntRange(1, 1000), default=5, help="Number of texels to find."),
    option("--one-each", is_flag=True, help="Find only the nearest texel of each texture."),
)
def command(
    codes: Path,
    among: tuple[Path, ...],
    output: Path | None,
    texel: tuple[int, int],
    count: int,
    one_each: bool,
) -> None:
    """Find the texels that look most like a given texel of CODES, an encoded texture.

    The search covers the encoded textures AMONG, or CODES itself if none is given; all must come
    from the same codec. The distance is the RMS difference of square roots of reflectance over many
    pairs of directions.
    """
    from nacre.figures.plot import check_plot_path, write_plot
    from nacre.figures.texel_spheres import spheres_figure, texel_spheres
    from nacre.textures.embedding import nearest_texels
    from nacre.textures.latent_file import load_latent_maps
    from nacre.workflows.texel import texel_index

    paths = [codes, *(among or [codes])]
    for path in paths:
        expect(path, "an encoded texture")
    if output is not None:
        check_plot_path(output)
        options.check_outputs([output], paths)
    line = progress(codes.stem, "reading")
    texture, *textures = load_latent_maps(paths)
    height, width, _ = texture.codes.shape
    index, (x, y) = texel_index(codes, width, height, texel), texel
    code = texture.codes[y, x].astype(np.float32)
    same = [path.resolve() == codes.resolve() for path in paths[1:]]
    itself = (same.index(True), index) if any(same) else None
    found = nearest_texels(
        code, textures, count, one_each=one_each, leave_out=itself, progress=line
    )
    rows, shown = [], [code]
    for neighbor in found:
        of = textures[neighbor.texture].codes
        row, column = divmod(neighbor.texel, of.shape[1])
        rows.append((str(paths[1 + neighbor.texture]), column, row, neighbor.distance))
        shown.append(of[row, column].astype(np.float32))
    if output is not None:
        captions = [
            f"{codes.stem} ({x}, {y})",
            *(f"{Path(file).stem} ({i}, {j})\n{far:.3f}" for file, i, j, far in rows),
        ]
        spheres = texel_spheres(texture.codec, np.stack(shown))
        write_plot(spheres_figure(spheres, captions), output)
    print_table(("texture", "x", "y", "distance"), rows)
    nearest = [dict(zip(("file", "x", "y", "distance"), row, strict=True)) for row in rows]
    lines = [f"{output}: {len(shown)} spheres"] if output is not None else []
    report(lines, {"file": str(codes), "x": x, "y": y, "nearest": nearest})
