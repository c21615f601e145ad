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
from nacre.errors import FormatError

if TYPE_CHECKING:
    from nacre.brdf import Brdf
    from nacre.measured.textures.image_folder import Quantity

_PAIRS = 1 << 14  # of directions, at which a table is compared with its source


@make(
    "convert",
    options.argument("source", metavar="INPUT"),
    options.output_option("File to write; its ending chooses the format."),
    option("--material", applies="brdf", help="Name of the material in a file that holds several."),
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

    Any reflectance can become an RGL, UTIA or Radiance table (.bsdf; .bin, .exr; .xml) or samples
    (.csv), an isotropic one also a MERL, MDL, Zemax, Speos or OpenMATERIAL 3D table (.binary, .npz;
    .mbsdf; .zemax.bsdf; .brdf; .xompt). Neural and analytic formats accept only neural and analytic
    materials: use nacre fit for a table. A texture (a file, a folder of images or a list of
    photographs) becomes an archive (.npz) or a factored file (.btf).
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
        raise FormatError(f"{output}: for a physical network, use nacre fit --physical")
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
        note(f"{output}: holds the color of {source} but not its wavelengths; {kept}")
    median = facts.get("table_error_median")
    text = "" if median is None else f"f_r within {100.0 * median:.2g} % in the median"
    report_file(output, text, kind="brdf", **facts)


def _table_errors(brdf: Brdf, output: Path) -> dict[str, Any]:
    """What a table has lost by its resolution; empty for other formats."""
    from nacre.formats import load_brdf, target
    from nacre.metrics.metrics import angular_errors

    if target(output).resolution is None:
        return {}
    found = angular_errors(brdf, load_brdf(output), _PAIRS)
    return {"table_error_median": found.relative_median} if found.rmse_cosine > 0.0 else {}
