from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.kinds import check_pixels, kind_of
from nacre.cli.options import option
from nacre.cli.ranges import IntRange
from nacre.cli.report import note, progress, report_file, say

if TYPE_CHECKING:
    from nacre.measured.textures.image_folder import Quantity


@make(
    "convert",
    options.argument("source", metavar="INPUT"),
    options.output_option("File to write; its ending chooses the format."),
    options.resolution_option(applies="brdf"),
    option(
        "--physical",
        is_flag=True,
        applies="brdf",
        help="Make it reciprocal, darken views that would reflect more light than they receive, "
        "and report the change.",
    ),
    options.precision_option(applies="btf", shown="the input's, else half"),
    "Precision of the values in an .npz file.",
    option("--components", IntRange(1), applies="btf", metavar="K"),
    "Components per channel in a factored file (.btf).",
    options.pixels_option(applies="btf"),
    reads=True,
)
def command(
    source: Path,
    output: Path,
    resolution: tuple[int, ...] | None,
    physical: bool,
    precision: str | None,
    components: int | None,
    pixels: Quantity | None,
) -> None:
    """Write a material in another format.

    Any reflectance can become an RGL, UTIA or Radiance table (.bsdf; .bin, .exr; .xml) or samples
    (.csv), an isotropic one also a MERL, MDL, Zemax, Speos or OpenMATERIAL 3D table (.binary, .npz;
    .mbsdf; .zemax.bsdf; .brdf; .xompt). Neural and analytic formats accept only neural and analytic
    materials: use nacre fit for a table. A texture (a file, a folder of images or a list of
    photographs) becomes an archive (.npz) or a factored file (.btf).
    """
    if kind_of(source) == "brdf":
        _reflectance(source, output, resolution, physical)
        return
    from nacre.cli.btf.written import report_texture
    from nacre.formats import load_btf, target
    from nacre.workflows.conversion import convert_btf

    target(output, "btf")
    options.check_outputs([output], [source])
    check_pixels(source, pixels)
    texture, line = load_btf(source, quantity=pixels), progress(output.stem)
    made = convert_btf(texture, output, precision=precision, components=components, progress=line)
    report_texture(output, texture, made.loss)


def _reflectance(
    source: Path,
    output: Path,
    resolution: tuple[int, ...] | None,
    physical: bool,
) -> None:
    from nacre.formats import load_brdf
    from nacre.workflows.conversion import checked_writer, convert_brdf

    checked_writer(output, resolution, physical)
    options.check_outputs([output], [source])
    line = progress(output.stem, "reading")
    brdf = load_brdf(source)
    line("writing", 0, 1)
    made = convert_brdf(brdf, output, resolution=resolution, physical=physical)
    facts: dict[str, Any] = {}
    text = ""
    if made.change is not None:
        facts = {"physical": asdict(made.change)}
        say(f"{output}: {made.change}")
    if made.median is not None:
        facts = {"table_error_median": made.median}
        text = f"f_r within {100.0 * made.median:.2g} % in the median"
    if made.colors_only:
        kept = "_spec.bsdf and .csv keep them"
        note(f"{output}: holds the color of {source} but not its wavelengths; {kept}")
    for text_of_source in brdf.notes:
        note(f"{source}: {text_of_source}")
    report_file(output, text, kind="brdf", **facts)
