from __future__ import annotations

import math
from pathlib import Path

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.options import option
from nacre.cli.ranges import IntRange
from nacre.cli.report import print_table, progress, report


@make(
    "sample",
    options.output_option("Folder for codes (.json), or one picture (.png, .jpg)."),
    options.basis_option(),
    option("--count", IntRange(1, 1000), default=9, help="Number of materials."),
    option("--like", default="", metavar="KIND|FILE"),
    "Kind of material (metal, paint, plastic, fabric, paper, wood, rubber, or another part of "
    "training materials' names), or a material or code to resemble.",
    options.seed_option(),
    options.picture_size_option(),
    options.spp_option(),
)
def command(
    output: Path, basis_name: str, count: int, like: str, seed: int, size: int, spp: int | None
) -> None:
    """Draw plausible materials that nobody measured, like those the basis was trained on.

    Each is more plausible than the least plausible 5 % of the training materials, and none reflects
    more light than it receives.
    """
    from nacre.figures.code_views import strip
    from nacre.latent import find_basis, save_code
    from nacre.mitsuba.preview import DISPLAY_IMAGES, write_bytes
    from nacre.workflows import draw_materials, plausibility

    picture = output.suffix.lower() in DISPLAY_IMAGES
    options.check_outputs([output] if picture else [], [Path(like), Path(basis_name)])
    line = progress(output.stem, "drawing")
    basis = find_basis(basis_name)
    materials = draw_materials(basis, count, like=like, seed=seed, progress=line)
    facts = [plausibility(material) for material in materials]
    if picture:
        write_bytes(strip(materials, size, spp, line, math.ceil(math.sqrt(count))), output)
    else:
        output.mkdir(parents=True, exist_ok=True)
        for index, material in enumerate(materials):
            save_code(material, output / f"{index:0{len(str(count - 1))}d}.json")
    print_table(
        ("material", "more plausible than", "largest albedo"),
        (
            (material.name, f"{100.0 * fact.typical:.0f} %", f"{fact.albedo:.3f}")
            for material, fact in zip(materials, facts, strict=True)
        ),
    )
    data = [
        {"name": m.name, "log_density": f.log_density, "typical": f.typical, "albedo": f.albedo}
        for m, f in zip(materials, facts, strict=True)
    ]
    report(f"{output}: {count} materials", {"output": str(output), "materials": data})
