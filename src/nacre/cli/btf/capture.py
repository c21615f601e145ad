from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from nacre.cli import options, plans
from nacre.cli.btf.written import is_encoded, report_codes, report_texture
from nacre.cli.command import command as make
from nacre.cli.options import option
from nacre.cli.ranges import IntRange
from nacre.cli.report import aside, progress, report
from nacre.errors import FormatError

if TYPE_CHECKING:
    from nacre.runtime.progress import Progress
    from nacre.textures.capture.dataset import Settings
    from nacre.textures.capture.recipe import Recipe


_CODES = "codes (.safetensors)"


@make(
    "capture",
    options.argument("recipe", None, required=False),
    option("--all everything", is_flag=True, help="Capture all built-in recipes."),
    options.output_option(
        "Texture to write: values, or codes (.safetensors); a folder with --all."
    ),
    options.texels_option(default="32", help="Texels along each edge, such as 32 or 32x32."),
    option("--paths", IntRange(1, 1 << 16), default=64, help="Light paths per texel."),
    options.directions_option(default="bonn"),
    options.seed_option(),
    option("--picture", options.OUTPUT, help="Also write a sheet of pictures (.png, .jpg, .exr)."),
    option("--height-map", options.OUTPUT),
    "Let texels follow the surface instead of a plane, as in Bonn's database, and write its "
    "heights (.exr, in widths of the texture).",
    options.codec_option(group=_CODES),
    option("--resume", is_flag=True, group=_CODES),
    "Resume the same command where it stopped.",
    plans=True,
)
def command(
    recipe: str | None,
    everything: bool,
    output: Path,
    texels: tuple[int, int],
    paths: int,
    directions: str,
    seed: int,
    picture: Path | None,
    height_map: Path | None,
    codec: Path | None,
    resume: bool,
) -> None:
    """Measure a made-up surface with a virtual gonioreflectometer.

    RECIPE is a built-in one (fabric, leather, wood, stone, felt, carpet or wallpaper, each with a
    number from 01 to 12) or a .json file with family, seed and parameters. With --all, eleven of
    each family go into OUTPUT/train and the twelfth into OUTPUT/unseen; a repeated run resumes.

    Codes need little memory and no room for values, however large the texture: texels are encoded
    as they are measured.

    A list of directions has the columns theta,phi in degrees, of which every pair is measured, or
    theta_l,phi_l,theta_v,phi_v or unit vectors lx,ly,lz,vx,vy,vz for the light and view of a pair.
    """
    from nacre.formats import is_btf
    from nacre.measured.textures.direction_list import named_directions
    from nacre.textures.capture.dataset import Settings, capture_all, place
    from nacre.textures.capture.gonioreflectometer import STEEPEST
    from nacre.textures.capture.recipe import built_in

    if everything == (recipe is not None):
        raise click.UsageError("expected either RECIPE or --all")
    if everything and picture:
        raise click.UsageError("--picture shows a single RECIPE")
    if everything and height_map:
        raise click.UsageError("--height-map is for a single RECIPE")
    if texels[0] != texels[1] or texels[0] > 4096:
        raise click.BadParameter("--texels: a capture is square, with up to 4096 texels per edge")
    if not directions.lower().endswith(".csv") and is_btf(directions):
        raise FormatError(
            f"{directions}: is a texture, expected bonn, utia or a list of directions (.csv)"
        )
    if recipe is not None and is_btf(recipe):
        raise FormatError(f"{recipe}: is a texture, expected the name of a recipe or its .json")
    if everything or not is_encoded(output):
        for name, flag in (("codec", "--codec"), ("resume", "--resume")):
            if options.is_given(name):
                raise click.UsageError(f"{flag} is for {_CODES}; {output} is to hold values")
    settings = Settings(*named_directions(directions, STEEPEST), texels[0], paths, seed)
    if recipe is not None:
        _one(recipe, output, settings, (picture, height_map), codec, resume)
        return
    if plans.is_wanted():
        plans.tell_captures(settings, [output / place(each) for each in built_in()])
        return
    line = progress("capture")
    names: list[str] = []

    def begun(recipe: Recipe, done: int, total: int) -> Progress:
        names.append(recipe.name)
        aside(f"{done + 1} of {total}: {recipe.name}")
        return line

    capture_all(output, settings, begun)
    report(f"{output}: complete", {"output": str(output), "captured": names})


def _one(
    recipe: str,
    output: Path,
    settings: Settings,
    pictures: tuple[Path | None, Path | None],
    codec: Path | None,
    resume: bool,
) -> None:
    from nacre.figures.texture_views import capture_sheet
    from nacre.formats import save, target
    from nacre.mitsuba.preview import check_image_path, write_image
    from nacre.textures.capture.recipe import find
    from nacre.textures.codecs.codec_file import codec_path
    from nacre.textures.height_file import check_height_map, write_heights
    from nacre.workflows.encoding import encode_capture

    picture, height_map = pictures
    if picture:
        check_image_path(picture)
    if height_map:
        check_height_map(height_map)
    found, model = find(recipe), codec_path(codec) if is_encoded(output) else None
    target(output, "btf")
    if plans.is_wanted():
        plans.tell_captures(settings, [output], model)
        return
    state = [Path(f"{output}.state")] if model else []
    options.check_outputs([output, *pictures], [Path(recipe), model], state)
    line = progress(found.name)
    taken = settings.capture(found, on_surface=height_map is not None)
    if model:
        encoded = encode_capture(taken, output, model=model, resume=resume, progress=line)
        report_codes(encoded, found.name)
    else:
        # An archive takes texels in order; other formats ask for them again.
        btf = taken if output.suffix.lower() == ".npz" else taken.table(line)
        report_texture(output, btf, save(btf, output, progress=line))
    if height_map:
        write_heights(taken.surface.height_map(), height_map)
    if picture:
        write_image(capture_sheet(taken), picture)
