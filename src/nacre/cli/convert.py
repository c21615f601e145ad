"""`nacre convert`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from click import IntRange

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.materials import check_pixels, kind_of
from nacre.cli.options import option
from nacre.cli.progress import progress
from nacre.cli.report import note, report_file

if TYPE_CHECKING:
    from nacre.measured.textures.image_folder import Quantity


@make(
    "convert",
    options.argument("source", metavar="INPUT"),
    options.output_option("File to write, in the format that its name ends in."),
    option("--material", applies="brdf", help="Name of the material, for a file of several."),
    options.resolution_option(applies="brdf"),
    options.precision_option(applies="btf", shown="that of the input, else half"),
    "Precision of the values of an .npz.",
    option("--components", IntRange(1), applies="btf", metavar="K"),
    "Components of each channel in a factored file (.btf).",
    options.pixels_option(applies="btf"),
)
def command(
    source: Path,
    output: Path,
    material: str | None,
    resolution: tuple[int, ...] | None,
    precision: str | None,
    components: int | None,
    pixels: Quantity | None,
) -> None:
    """Write a material in another format.

    Any reflectance becomes an RGL or UTIA table (.bsdf; .bin, .exr) or samples (.csv), any
    isotropic one a MERL table (.binary, .npz). Neural and analytic formats take neural and analytic
    materials only: nacre fit makes one of a table. A texture becomes an archive (.npz) or a
    factored file (.btf); it may be a file, a folder of images or a list of photographs (.csv).
    """
    if kind_of(source) == "brdf":
        _reflectance(source, output, material, resolution)
        return
    from nacre.cli.btf.written import report_texture
    from nacre.formats import load_btf, save, target

    target(output, "btf")
    options.check_outputs([output], [source])
    check_pixels(source, pixels)
    texture = load_btf(source, quantity=pixels)
    line = progress(output.stem)
    loss = save(texture, output, progress=line, precision=precision, components=components)
    report_texture(output, texture, loss)


def _reflectance(
    source: Path, output: Path, material: str | None, resolution: tuple[int, ...] | None
) -> None:
    from nacre.formats import check_target, load_brdf, loses_bands, writer

    write = writer(output, resolution)
    options.check_outputs([output], [source])
    report = progress(output.stem, "reading")
    brdf = load_brdf(source, material)
    check_target(output, brdf)
    report("writing", 0, 1)
    write(brdf, output)
    if brdf.wavelengths is not None and (resolution or loses_bands(brdf, output)):
        note(f"{output}: holds the color of {source}, not its wavelengths; .csv keeps them")
    report_file(output, "", kind="brdf")
