from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.kinds import NAMES, kind_of
from nacre.cli.options import option
from nacre.cli.ranges import IntRange
from nacre.cli.report import keyed, print_facts, print_table, progress, report
from nacre.errors import FormatError


@make(
    "compare",
    options.argument("reference"),
    options.argument("other"),
    options.output_option(required=False, shown="OTHER_compared.png"),
    "Picture to write (.png, .jpg).",
    options.environment_option(applies="brdf"),
    option("--size", IntRange(16, 2048), applies="brdf", default=128),
    "Width and height of each picture in pixels.",
    option("--pairs", IntRange(1), applies="btf", shown="all"),
    "Number of random pairs of directions to compare.",
    options.seed_option(applies="btf"),
    options.pixels_option(applies="btf"),
)
def command(reference: Path, other: Path, output: Path | None, **chosen: Any) -> None:
    """Compare OTHER with REFERENCE: error figures, and a picture of both and their difference.

    Reflectances are compared on rendered spheres and over pairs of directions. Textures must have
    the same pairs of directions; an encoded OTHER is decoded at those of the reference.
    """
    from nacre.mitsuba.preview import DISPLAY_IMAGES, check_image_path

    kinds = kind_of(reference), kind_of(other)
    if kinds[0] != kinds[1]:
        raise FormatError(
            f"{other}: is {NAMES[kinds[1]]}, but {reference} is {NAMES[kinds[0]]}; nacre btf "
            "average turns a texture into a reflectance, nacre btf tile does the reverse"
        )
    output = output or Path(f"{other.stem}_compared.png")
    check_image_path(output, DISPLAY_IMAGES)
    run = _reflectances if kinds[0] == "brdf" else _textures
    run(reference, other, output, chosen)


def _names(reference: Path, other: Path, output: Path) -> dict[str, Any]:
    return {"reference": str(reference), "other": str(other), "output": str(output)}


def _reflectances(reference: Path, other: Path, output: Path, chosen: dict[str, Any]) -> None:
    from nacre.figures import picture
    from nacre.formats import load_brdf
    from nacre.metrics import compare
    from nacre.mitsuba.environment import load_environment
    from nacre.mitsuba.preview import write_bytes

    options.check_outputs([output], [reference, other])
    line = progress(other.stem, "reading")
    materials = load_brdf(reference), load_brdf(other)
    lighting = chosen["environment"] and load_environment(chosen["environment"])
    comparison = compare(
        *materials, size=chosen["size"], environment=lighting, progress=line.parts("comparing")
    )
    comparison = replace(comparison, truth=reference.name, other=other.name)
    write_bytes(picture(comparison), output)
    figures: dict[str, dict[str, float]] = {}
    for where, measure, value in comparison.rows():
        figures.setdefault(where, {})[measure] = value
    for light, rows in figures.items():
        print_table((light, ""), rows.items())
    names = _names(reference, other, output)
    report(f"{output}: reference | other | FLIP error", names | keyed({"figures": figures}))


def _textures(reference: Path, other: Path, output: Path, chosen: dict[str, Any]) -> None:
    from contextlib import ExitStack

    from nacre.figures.texture_sheet import texture_sheet
    from nacre.formats import identify, load_btf
    from nacre.measured.textures.transposition import transposed
    from nacre.metrics.texture_comparison import compare_textures
    from nacre.metrics.texture_errors import UNITS
    from nacre.mitsuba.preview import write_bytes
    from nacre.workflows.identity import source_files

    paths, pixels, seed = (reference, other), chosen["pixels"], chosen["seed"]
    images = [bool(identify(path).claims_folder) for path in paths]
    if pixels is not None and not any(images):
        raise click.BadParameter("--pixels: neither texture is a folder of images")
    line = progress(other.stem, "reading")
    textures = [
        load_btf(path, quantity=pixels if inside else None)
        for path, inside in zip(paths, images, strict=True)
    ]
    files = map(source_files, paths, textures)
    options.check_outputs([output], [*paths, *(file for some in files for file in some)])
    with ExitStack() as stack:
        readable = [stack.enter_context(transposed(btf, progress=line)) for btf in textures]
        found = compare_textures(*readable, pairs=chosen["pairs"], seed=seed, progress=line)
    write_bytes(texture_sheet(textures[0], textures[1], (reference.name, other.name)), output)
    worst = [{"x": x, "y": y, "MSE x 1e4": 1e4 * mse} for x, y, mse in found.worst()]
    shown, by_view = found.errors.shown()
    rows = [("pairs compared", found.compared), *shown.items()]
    print_facts(f"{other.name} against {reference.name}", rows, UNITS)
    print_table(("views", "MSE x 1e4"), by_view.items())
    print_table(
        ("worst texels (x, y)", "MSE x 1e4"),
        [(f"{w['x']}, {w['y']}", w["MSE x 1e4"]) for w in worst],
    )
    facts = keyed({"pairs compared": found.compared, **found.errors.facts()}, UNITS)
    data = _names(reference, other, output) | facts | keyed({"worst texels": worst})
    report(f"{output}: reference | other | error", data)
