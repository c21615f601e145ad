"""`nacre btf plan`."""

from __future__ import annotations

from pathlib import Path

import click

from nacre.cli.btf.kinds import expect
from nacre.cli.console import Stages, check_outputs, console, file_path
from nacre.cli.ranges import SEED, FiniteRange

_POLAR = FiniteRange(0.0, 89.0, min_open=True)


@click.command("plan")
@click.argument("count", type=click.IntRange(1, 4096))
@click.option("-o", "--output", required=True, type=file_path(), help="List to write (.csv).")
@click.option("--lights", default=75.0, type=_POLAR, help="Largest polar angle of lights.")
@click.option("--views", default=75.0, type=_POLAR, help="Largest polar angle of views.")
@click.option("--flash", is_flag=True, help="The light is at the camera, as a phone's.")
@click.option(
    "--model", type=file_path(), help="For whose codes. Default: the one that comes with nacre."
)
@click.option("--seed", default=0, type=SEED, help="Of the directions to choose from.")
def command(
    count: int,
    output: Path,
    lights: float,
    views: float,
    flash: bool,
    model: Path | None,
    seed: int,
) -> None:
    """List COUNT pairs of a light and a view to photograph a flat sample at, for few captures.

    They are chosen one by one so that the model can tell most from them: the first half of a plan
    is a plan. The list names a file for each photograph; nacre btf encode FOLDER --directions LIST
    encodes a folder of such files, and nacre btf capture --dome LIST takes them virtually. Angles
    are in degrees.
    """
    from nacre.textures.codecs.codec_file import PUBLISHED, load_codec
    from nacre.textures.plan import CANDIDATES, candidate_pairs, informative, write_plan

    if output.suffix.lower() != ".csv":
        raise click.BadParameter(f"{output}: a list of directions is a .csv file")
    model = model or PUBLISHED
    check_outputs([output], [model])
    expect(model, "a model of textures")
    codec = load_codec(model)
    many = max(CANDIDATES, count)
    wi, wo = candidate_pairs(many, lights=lights, views=views, flash=flash, seed=seed)
    with Stages() as stages:
        chosen = informative(codec, wi, wo, count, stages.add(output.stem))
    write_plan(wi[chosen], wo[chosen], output)
    console.print(f"{output}: {count:,} pairs of directions", markup=False)
