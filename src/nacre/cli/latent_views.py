"""`nacre latent interpolate` and `map`: what lies between codes, and where they lie."""

from __future__ import annotations

from pathlib import Path

import click

from nacre.cli.console import Stages, check_outputs, console, file_path, print_table
from nacre.cli.ranges import SEED
from nacre.errors import NacreError

basis_option = click.option(
    "--basis",
    "basis_name",
    metavar="[neural|hypernetwork|FILE]",
    default="neural",
    show_default=True,
    help="One that comes with nacre, or a file made by nacre latent train.",
)
_picture_option = click.option(
    "-o", "--output", required=True, type=file_path(), help="Picture to write (.png, .jpg)."
)


@click.command("interpolate")
@click.argument("first", type=file_path())
@click.argument("second", type=file_path())
@basis_option
@_picture_option
@click.option("--count", default=5, type=click.IntRange(2, 64), help="Materials, ends included.")
@click.option("--codes", type=file_path(), help="Folder for the code of each (.json).")
@click.option("--size", default=192, type=click.IntRange(16, 1024), help="Pixels of each.")
@click.option("--spp", default=64, type=click.IntRange(1), help="Samples per pixel.")
def interpolate(
    first: Path,
    second: Path,
    basis_name: str,
    output: Path,
    count: int,
    codes: Path | None,
    size: int,
    spp: int,
) -> None:
    """Render what lies between two materials or codes (.json).

    Of pca and neural the logarithm of f_r is linear in a code: what lies between reflects no more
    than the same mixture of the ends would, in any direction.
    """
    from nacre.figures.code_views import between, coded, strip
    from nacre.latent import find_basis, save_code
    from nacre.metrics import albedo
    from nacre.render.preview import DISPLAY_IMAGES, check_image_path, write_bytes

    check_image_path(output, DISPLAY_IMAGES)
    check_outputs([output], [first, second, Path(basis_name)])
    ends = coded([first, second], find_basis(basis_name))
    materials = between(ends[0], ends[1], count)
    if codes:
        codes.mkdir(parents=True, exist_ok=True)
        for index, material in enumerate(materials):
            save_code(material, codes / f"{index:02d}.json")
    with Stages() as stages:
        picture = strip(materials, size, spp, stages.add(output.stem))
    write_bytes(picture, output)
    rows = [
        (f"{index / (count - 1):.2f}", *(f"{x:.3f}" for x in albedo(material, [0.0]).value[0]))
        for index, material in enumerate(materials)
    ]
    print_table(("fraction of the second", "albedo, red", "green", "blue"), rows)
    console.print(f"{output}: {count} materials", markup=False)


@click.command("map")
@click.argument("files", metavar="INPUT...", nargs=-1, required=True, type=file_path())
@basis_option
@_picture_option
@click.option(
    "--highlight",
    "highlighted",
    metavar="INPUT",
    type=file_path(),
    multiple=True,
    help="A material among the inputs to ring in red, and to list the nearest of. May be repeated.",
)
@click.option("--seed", default=0, type=SEED, help="Random seed: same seed, same map.")
def chart(
    files: tuple[Path, ...], basis_name: str, output: Path, highlighted: tuple[Path, ...], seed: int
) -> None:
    """Lay out materials or codes by t-SNE, neighbors side by side."""
    from nacre.figures.code_views import coded, draw_map
    from nacre.figures.plot import check_plot_path, write_plot
    from nacre.latent import find_basis
    from nacre.latent.map import nearest

    check_plot_path(output)
    check_outputs([output], [*files, Path(basis_name)])
    missing = [path for path in highlighted if path not in files]
    if missing:
        raise NacreError(f"{missing[0]}: is highlighted but not among the inputs")
    basis = find_basis(basis_name)
    names = [path.stem for path in files]
    with Stages() as stages:
        report = stages.add(output.stem)
        materials = coded(files, basis, report)
        figure = draw_map(names, materials, {path.stem for path in highlighted}, seed, report)
    write_plot(figure, output)
    codes = [material.code for material in materials]
    rows = [
        (path.stem, ", ".join(names[k] for k in nearest(codes, files.index(path), 3)))
        for path in highlighted
    ]
    if rows:
        print_table(("material", "nearest"), rows)
    console.print(f"{output}: {len(files)} materials", markup=False)
