"""`nacre convert`."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from click import IntRange

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.kinds import check_pixels, kind_of
from nacre.cli.options import option
from nacre.cli.progress import progress
from nacre.cli.report import note, report_file, say
from nacre.errors import FormatError, MissingExtraError

if TYPE_CHECKING:
    from nacre.brdf import Brdf
    from nacre.measured.textures.image_folder import Quantity

_PAIRS = 1 << 14  # at which a table is compared with what it was made of


@make(
    "convert",
    options.argument("source", metavar="INPUT"),
    options.output_option("File to write, in the format that its name ends in."),
    option("--material", applies="brdf", help="Name of the material, for a file of several."),
    options.resolution_option(applies="brdf"),
    option(
        "--physical",
        is_flag=True,
        applies="brdf",
        help="Make it reciprocal, and darken views at which it would reflect more light than it "
        "gets; says what that changes.",
    ),
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
    physical: bool,
    precision: str | None,
    components: int | None,
    pixels: Quantity | None,
) -> None:
    """Write a material in another format.

    Any reflectance becomes an RGL, UTIA or Radiance table (.bsdf; .bin, .exr; .xml) or samples
    (.csv), any isotropic one a MERL, MDL, Zemax, Speos or OpenMATERIAL 3D table (.binary, .npz;
    .mbsdf; .zemax.bsdf; .brdf; .xompt). Neural and analytic formats take neural and analytic
    materials only: nacre fit makes one of a table. A texture becomes an archive (.npz) or a
    factored file (.btf); it may be a file, a folder of images or a list of photographs (.csv).
    """
    if kind_of(source) == "brdf":
        _reflectance(source, output, material, resolution, physical)
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
    source: Path,
    output: Path,
    material: str | None,
    resolution: tuple[int, ...] | None,
    physical: bool,
) -> None:
    from nacre.formats import check_target, load_brdf, loses_bands, target, writer

    if physical and target(output).holds:
        raise FormatError(f"{output}: nacre fit --physical makes physical networks, of tables too")
    write = writer(output, resolution)
    options.check_outputs([output], [source])
    report = progress(output.stem, "reading")
    brdf = load_brdf(source, material)
    check_target(output, brdf)
    report("writing", 0, 1)
    facts: dict[str, Any] = {}
    if physical:
        from nacre.workflows.physical import write_physical

        change = write_physical(brdf, output, write)
        facts = {"physical": asdict(change)}
        say(f"{output}: {change}")
    else:
        write(brdf, output)
        facts = _table_errors(brdf, output)
    if (physical and brdf.wavelengths is not None) or loses_bands(brdf, output, bool(resolution)):
        kept = "_spec.bsdf and .csv keep them"
        note(f"{output}: holds the color of {source}, not its wavelengths; {kept}")
    median = facts.get("table_error_median")
    text = "" if median is None else f"f_r within {100.0 * median:.2g} % in the median"
    report_file(output, text, kind="brdf", **facts)


def _table_errors(brdf: Brdf, output: Path) -> dict[str, Any]:
    """What a table of a resolution that may be chosen has lost; empty where nothing."""
    from nacre.formats import load_brdf, target
    from nacre.metrics.metrics import angular_errors

    if target(output).resolution is None:
        return {}
    try:
        found = angular_errors(brdf, load_brdf(output), _PAIRS)
    except MissingExtraError:  # reading takes a library that writing does without
        return {}
    return {"table_error_median": found.relative_median} if found.rmse_cosine > 0.0 else {}
