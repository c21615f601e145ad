"""`nacre compare`."""

from __future__ import annotations

import dataclasses
import itertools
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click import IntRange

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.materials import kind_of
from nacre.cli.options import option
from nacre.cli.progress import progress
from nacre.cli.report import json_key, keyed, print_facts, print_json, print_table, say
from nacre.cli.session import session
from nacre.errors import FormatError

if TYPE_CHECKING:
    from nacre.measured.textures.image_folder import Quantity


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
    "Random pairs of directions to compare.",
    options.seed_option(applies="btf"),
    options.pixels_option(applies="btf"),
)
def command(
    reference: Path,
    other: Path,
    output: Path | None,
    environment: Path | None,
    size: int,
    pairs: int | None,
    seed: int,
    pixels: Quantity | None,
) -> None:
    """Compare OTHER with the REFERENCE: error figures, and a picture of both and their difference.

    Reflectances are compared on rendered spheres and over pairs of directions. Textures are
    compared at the same pairs of directions; an encoded one as OTHER is decoded at those of the
    reference.
    """
    from nacre.render.preview import DISPLAY_IMAGES, check_image_path

    kinds = kind_of(reference), kind_of(other)
    if kinds[0] != kinds[1]:
        names = {"brdf": "a reflectance", "btf": "a texture"}
        raise FormatError(
            f"{other}: is {names[kinds[1]]}, and {reference} {names[kinds[0]]}; nacre btf average "
            "makes a reflectance of a texture, nacre btf tile a texture of a reflectance"
        )
    output = output or Path(f"{other.stem}_compared.png")
    check_image_path(output, DISPLAY_IMAGES)
    if kinds[0] == "brdf":
        _reflectances(reference, other, output, environment, size)
    else:
        _textures(reference, other, output, pairs, seed, pixels)


def _names(reference: Path, other: Path, output: Path) -> dict[str, Any]:
    return {"reference": str(reference), "other": str(other), "output": str(output)}


def _reflectances(
    reference: Path, other: Path, output: Path, environment: Path | None, size: int
) -> None:
    from nacre.figures import picture
    from nacre.formats import load_brdf
    from nacre.metrics import compare
    from nacre.render.environment import load_environment
    from nacre.render.preview import write_bytes

    options.check_outputs([output], [reference, other])
    report = progress(other.stem)
    report("reading", 0, 1)
    materials = load_brdf(reference), load_brdf(other)
    lighting = load_environment(environment) if environment else None
    comparison = compare(
        *materials,
        size=size,
        environment=lighting,
        progress=lambda part: report("comparing", round(100 * part), 100),
    )
    comparison = dataclasses.replace(comparison, truth=reference.name, other=other.name)
    write_bytes(picture(comparison), output)
    if session().as_json:
        figures: dict[str, dict[str, float]] = {}
        for where, measure, value in comparison.rows():
            figures.setdefault(json_key(where), {})[json_key(measure)] = value
        print_json({**_names(reference, other, output), "figures": figures})
        return
    for light, rows in itertools.groupby(comparison.rows(), lambda row: row[0]):
        print_table((light, ""), [row[1:] for row in rows])
    say(f"{output}: reference | other | FLIP error")


def _textures(
    reference: Path,
    other: Path,
    output: Path,
    pairs: int | None,
    seed: int,
    pixels: Quantity | None,
) -> None:
    from contextlib import ExitStack

    from nacre.figures.texture_sheet import texture_sheet
    from nacre.formats import identify, load_btf
    from nacre.measured.textures.transposition import transposed
    from nacre.metrics.texture_comparison import compare_textures
    from nacre.metrics.texture_errors import UNITS
    from nacre.render.preview import write_bytes
    from nacre.workflows.identity import source_files

    paths = reference, other
    images = [bool(identify(path).claims_folder) for path in paths]
    if pixels is not None and not any(images):
        raise click.BadParameter("--pixels: neither texture is a folder of images")
    report = progress(other.stem)
    report("reading", 0, 1)
    textures = [
        load_btf(path, quantity=pixels if inside else None)
        for path, inside in zip(paths, images, strict=True)
    ]
    files = map(source_files, paths, textures)
    options.check_outputs([output], [*paths, *(file for some in files for file in some)])
    with ExitStack() as stack:
        readable = [stack.enter_context(transposed(btf, progress=report)) for btf in textures]
        found = compare_textures(*readable, pairs=pairs, seed=seed, progress=report)
    write_bytes(texture_sheet(textures[0], textures[1], (reference.name, other.name)), output)
    worst = [{"x": x, "y": y, "MSE x 1e4": 1e4 * mse} for x, y, mse in found.worst()]
    if session().as_json:
        facts = keyed({"pairs compared": found.compared, **found.errors.facts()}, UNITS)
        texels = [keyed(texel) for texel in worst]
        print_json({**_names(reference, other, output), **facts, "worst_texels": texels})
        return
    shown, by_view = found.errors.shown()
    rows = [("pairs compared", found.compared), *shown.items()]
    print_facts(f"{other.name} against {reference.name}", rows, UNITS)
    print_table(("views", "MSE x 1e4"), by_view.items())
    print_table(
        ("worst texels (x, y)", "MSE x 1e4"),
        [(f"{w['x']}, {w['y']}", w["MSE x 1e4"]) for w in worst],
    )
    say(f"{output}: reference | other | error")
