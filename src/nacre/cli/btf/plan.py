from __future__ import annotations

from pathlib import Path

import click

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.kinds import expect
from nacre.cli.options import option
from nacre.cli.ranges import FiniteRange, IntRange
from nacre.cli.report import progress, report

_POLAR = FiniteRange(0.0, 89.0, min_open=True)


@make(
    "plan",
    options.output_option("List to write (.csv); - is standard output.", text=".csv"),
    option("--count", IntRange(1, 4096), required=True, help="Number of photographs to take."),
    option("--max-light-angle", _POLAR, default=75.0),
    "Largest polar angle of the light, in degrees.",
    option("--max-view-angle", _POLAR, default=75.0),
    "Largest polar angle of the view, in degrees.",
    option("--flash", is_flag=True),
    "Flash at the camera, like a phone's.",
    options.codec_option(),
    options.seed_option(),
)
def command(
    output: Path,
    count: int,
    max_light_angle: float,
    max_view_angle: float,
    flash: bool,
    codec: Path | None,
    seed: int,
) -> None:
    """Choose the lights and views for a few photographs of a flat sample.

    Pairs are chosen one by one so that the codec learns most from them: the first half of a plan is
    itself a plan. The list names a file for each photograph; nacre fit FOLDER --directions LIST
    encodes a folder of such files, and nacre btf capture --directions LIST simulates them.
    """
    from nacre.textures.codecs.codec_file import codec_path, load_codec
    from nacre.textures.plan import CANDIDATES, candidate_pairs, informative, write_plan

    if output.suffix.lower() != ".csv":
        raise click.BadParameter(f"{output}: a list of directions is a .csv file")
    path = codec_path(codec)
    options.check_outputs([output], [path])
    expect(path, "a texture codec")
    line = progress(output.stem, "reading")
    wi, wo = candidate_pairs(
        max(CANDIDATES, count), lights=max_light_angle, views=max_view_angle, flash=flash, seed=seed
    )
    chosen = informative(load_codec(path), wi, wo, count, line)
    write_plan(wi[chosen], wo[chosen], output)
    report(f"{output}: {count:,} pairs of directions", {"output": str(output), "pairs": count})
