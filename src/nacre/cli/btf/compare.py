"""`nacre btf compare`."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import click

from nacre.cli.btf.kinds import expect
from nacre.cli.btf.options import pixels_option
from nacre.cli.console import (
    Stages,
    check_outputs,
    console,
    file_path,
    print_facts,
    print_json,
    print_table,
)
from nacre.cli.ranges import SEED

if TYPE_CHECKING:
    from nacre.measured.textures.image_folder import Quantity


@click.command("compare")
@click.argument("truth", type=file_path())
@click.argument("other", type=file_path())
@click.option("--picture", type=file_path(), help="Sheet of pictures to write (.png, .jpg).")
@click.option(
    "--pairs", type=click.IntRange(1), help="Random pairs of directions to compare.  [default: all]"
)
@click.option("--seed", default=0, type=SEED, help="Of those.")
@click.option(
    "--json",
    "as_json",
    is_flag=True,
    help="One object, as JSON; what is infinite or undefined is null.",
)
@pixels_option
def command(
    truth: Path,
    other: Path,
    picture: Path | None,
    pairs: int | None,
    seed: int,
    as_json: bool,
    pixels: Quantity | None,
) -> None:
    """Compare a texture with the TRUTH, at the same pairs of directions.

    An encoded texture as OTHER is decoded at those of the truth. Errors are of reflectance factors.
    Both may be files, folders of images or lists of photographs (.csv); images are read once, into
    a temporary file of the system's.
    """
    from nacre.figures.texture_sheet import texture_sheet
    from nacre.formats import identify, load_btf
    from nacre.measured.textures.transposition import transposed
    from nacre.metrics.texture_comparison import compare_textures
    from nacre.metrics.texture_errors import UNITS
    from nacre.render.preview import DISPLAY_IMAGES, check_image_path, write_bytes
    from nacre.workflows.identity import source_files

    for path in (truth, other):
        expect(path, "a texture", "an encoded texture")
    if picture is not None:
        check_image_path(picture, DISPLAY_IMAGES)
    paths = truth, other
    images = [bool(identify(path).claims_folder) for path in paths]
    if pixels is not None and not any(images):
        raise click.BadParameter("--pixels: neither texture lies in images")
    textures = [
        load_btf(path, quantity=pixels if inside else None)
        for path, inside in zip(paths, images, strict=True)
    ]
    if picture is not None:
        files = map(source_files, paths, textures)
        check_outputs([picture], [*paths, *(file for some in files for file in some)])
    with Stages() as stages, ExitStack() as stack:
        progress = stages.add(other.stem)
        readable = [stack.enter_context(transposed(btf, progress=progress)) for btf in textures]
        found = compare_textures(*readable, pairs=pairs, seed=seed, progress=progress)
    if picture is not None:
        write_bytes(texture_sheet(textures[0], textures[1], (truth.name, other.name)), picture)
    facts = found.errors.facts()
    worst = [{"x": x, "y": y, "MSE x 1e4": 1e4 * mse} for x, y, mse in found.worst()]
    if as_json:
        names = {"truth": str(truth), "other": str(other), "picture": str(picture or "")}
        print_json({**names, "pairs": found.compared, "errors": facts, "worst texels": worst})
        return
    shown, by_view = found.errors.shown()
    rows = [("pairs compared", found.compared), *shown.items()]
    print_facts(f"{other.name} against {truth.name}", rows, UNITS)
    print_table(("views", "MSE x 1e4"), by_view.items())
    print_table(
        ("worst texels (x, y)", "MSE x 1e4"),
        [(f"{w['x']}, {w['y']}", w["MSE x 1e4"]) for w in worst],
    )
    if picture is not None:
        console.print(f"{picture}: reference | other | error", markup=False)
