"""`nacre latent interpolate`."""

from __future__ import annotations

from pathlib import Path

from click import IntRange

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.options import option
from nacre.cli.progress import progress
from nacre.cli.report import print_table, report


@make(
    "interpolate",
    options.argument("first"),
    options.argument("second"),
    options.output_option("Picture to write (.png, .jpg)."),
    options.basis_option(),
    option("--count", IntRange(2, 64), default=5, help="Number of materials, both ends too."),
    option("--codes", options.OUTPUT, help="Folder to write the code of each to (.json)."),
    option("--size", IntRange(16, 1024), default=192, help="Width of each picture in pixels."),
    option("--spp", IntRange(1)),
    "Samples per pixel; by default those of nacre render, which are denoised.",
)
def command(
    first: Path,
    second: Path,
    output: Path,
    basis_name: str,
    count: int,
    codes: Path | None,
    size: int,
    spp: int | None,
) -> None:
    """Render what lies between FIRST and SECOND, which are materials or codes (.json).

    In pca and neural bases the logarithm of f_r is linear in a code: what lies between reflects no
    more than the same mixture of the ends would, in any direction.
    """
    from nacre.figures.code_views import between, coded, strip
    from nacre.latent import find_basis, save_code
    from nacre.metrics import albedo
    from nacre.render.preview import DISPLAY_IMAGES, check_image_path, write_bytes

    check_image_path(output, DISPLAY_IMAGES)
    options.check_outputs([output], [first, second, Path(basis_name)])
    line = progress(output.stem, "encoding")
    ends = coded([first, second], find_basis(basis_name))
    materials = between(ends[0], ends[1], count)
    if codes:
        codes.mkdir(parents=True, exist_ok=True)
        for index, material in enumerate(materials):
            save_code(material, codes / f"{index:02d}.json")
    write_bytes(strip(materials, size, spp, line), output)
    rows = [
        (index / (count - 1), [float(x) for x in albedo(material, [0.0]).value[0]])
        for index, material in enumerate(materials)
    ]
    columns = ("fraction of the second", "albedo, red", "green", "blue")
    print_table(columns, ((f"{part:.2f}", *(f"{x:.3f}" for x in rgb)) for part, rgb in rows))
    data = [{"fraction": fraction, "albedo": albedos} for fraction, albedos in rows]
    report(f"{output}: {count} materials", {"output": str(output), "materials": data})
