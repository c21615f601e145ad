"""`nacre btf capture`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from nacre.cli.btf.written import print_written
from nacre.cli.console import Stages, check_outputs, console, file_path
from nacre.cli.ranges import SEED
from nacre.errors import FormatError

if TYPE_CHECKING:
    from nacre.runtime.progress import Progress
    from nacre.textures.capture.dataset import Settings
    from nacre.textures.capture.recipe import Recipe


@click.command("capture")
@click.argument("recipe", required=False)
@click.option("--all", "everything", is_flag=True, help="Capture all built-in recipes.")
@click.option(
    "-o", "--output", required=True, type=file_path(), help="File to write; a folder with --all."
)
@click.option("--texels", default=32, type=click.IntRange(1, 4096), help="Rows, and columns.")
@click.option("--samples", default=64, type=click.IntRange(1, 1 << 16), help="Paths a texel.")
@click.option(
    "--dome", default="bonn", metavar="bonn|utia|PATH", help="Directions; or a list of some (.csv)."
)
@click.option("--seed", default=0, type=SEED, help="Same seed, same values.")
@click.option(
    "--picture", type=file_path(), help="Also write a sheet of pictures (.png, .jpg, .exr)."
)
def command(
    recipe: str | None,
    everything: bool,
    output: Path,
    texels: int,
    samples: int,
    dome: str,
    seed: int,
    picture: Path | None,
) -> None:
    """Measure a made-up surface with a virtual gonioreflectometer.

    RECIPE is a built-in one (fabric, leather, wood, stone, felt, carpet or wallpaper, each with 01
    to 12) or a JSON file with family, seed and parameters. With --all, every built-in one is
    captured: eleven of a family into OUTPUT/train, the twelfth into OUTPUT/unseen; a run that was
    stopped goes on where it was.

    A list of directions has the columns theta,phi in degrees (every pair of them is taken), or
    theta_l,phi_l,theta_v,phi_v or the unit vectors lx,ly,lz,vx,vy,vz (light and view of a pair).
    """
    from nacre.formats import is_btf
    from nacre.measured.textures.direction_list import named_directions
    from nacre.textures.capture.dataset import Settings, capture_all
    from nacre.textures.capture.gonioreflectometer import STEEPEST

    if everything == (recipe is not None):
        raise click.UsageError("expected either RECIPE or --all")
    if everything and picture:
        raise click.UsageError("--picture shows a single RECIPE")
    if is_btf(dome):
        raise FormatError(
            f"{dome}: is a texture, expected bonn, utia or a list of directions (.csv)"
        )
    if recipe is not None and is_btf(recipe):
        raise FormatError(f"{recipe}: is a texture, expected the name of a recipe or its .json")
    settings = Settings(*named_directions(dome, STEEPEST), texels, samples, seed)
    with Stages() as stages:
        if recipe is not None:
            _one(recipe, output, settings, picture, stages)
            return
        line = stages.add("")

        def report(recipe: Recipe, done: int, total: int) -> Progress:
            console.print(f"{done + 1} of {total}: {recipe.name}", markup=False)
            return line

        capture_all(output, settings, report)
    console.print(f"{output}: whole", markup=False)


def _one(
    recipe: str, output: Path, settings: Settings, picture: Path | None, stages: Stages
) -> None:
    """Capture one recipe into a file."""
    from nacre.figures.texture_views import capture_sheet
    from nacre.formats import save, target
    from nacre.render.preview import check_image_path, write_image
    from nacre.textures.capture.recipe import find

    if picture:
        check_image_path(picture)
    found = find(recipe)
    target(output, "btf")
    check_outputs([output, *([picture] if picture else [])], [Path(recipe)])
    line = stages.add(found.name)
    btf = settings.take(found, line)
    loss = save(btf, output, progress=line)
    if picture:
        write_image(capture_sheet(btf), picture)
    print_written(output, btf, loss)
