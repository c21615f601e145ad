from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.kinds import NAMES, kind_of
from nacre.cli.options import option
from nacre.cli.ranges import IntRange
from nacre.cli.report import (
    counted,
    keyed,
    print_facts,
    print_table,
    progress,
    report,
    say,
    tell,
)
from nacre.errors import FormatError
from nacre.io.names import stem

if TYPE_CHECKING:
    from nacre.brdf import Brdf
    from nacre.metrics import Comparison, Verdict


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
    reads=True,
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
    output = output or Path(f"{stem(other)}_compared.png")
    check_image_path(output, DISPLAY_IMAGES)
    run = _reflectances if kinds[0] == "brdf" else _textures
    run(reference, other, output, chosen)


def _names(reference: Path, other: Path, output: Path) -> dict[str, Any]:
    return {"reference": str(reference), "other": str(other), "output": str(output)}


def _reflectances(reference: Path, other: Path, output: Path, chosen: dict[str, Any]) -> None:
    from nacre.figures import picture
    from nacre.figures.comparison_sheet import flip_scale
    from nacre.formats import load_brdf
    from nacre.instruments.differences import spectral_differences
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
    colors = spectral_differences(*materials)
    comparison = replace(comparison, truth=reference.name, other=other.name, colors=colors)
    write_bytes(picture(comparison), output)
    figures = print_comparison(comparison)
    scale = flip_scale(comparison)
    text = f"{output}: reference | other | FLIP error, whose colors end at {scale:g} here"
    data = {"figures": figures, "color scale end": scale, "verdict": comparison.verdict.facts()}
    report(text, _names(reference, other, output) | keyed(data))
    conclude(comparison.verdict)
    if not comparison.verdict.alike and _is_fit(*materials):
        say(f"A longer fit may be closer: nacre fit {reference} --preset best")


def conclude(verdict: Verdict) -> None:
    """The verdict in words, and what its thresholds are."""
    from nacre.metrics.verdict import SOURCE

    say("")
    tell([str(verdict), *([f"({SOURCE})"] if verdict.flip else [])])


def _is_fit(reference: Brdf, other: Brdf) -> bool:
    """Whether a network was fitted to the file of the reference."""
    fitted, source = other.describe().get("fitted to sha256"), reference.source or {}
    return bool(fitted) and fitted == source.get("sha256")


def print_comparison(comparison: Comparison) -> dict[str, dict[str, float]]:
    """Print the figures of a comparison, one column for each light; by place and measure."""
    from nacre.metrics.comparison import BETTER

    figures: dict[str, dict[str, float]] = {}
    for where, measure, value in comparison.rows():
        figures.setdefault(where, {})[measure] = value
    lights = [item.light for item in comparison.lights]
    rows = [(m, *(figures[light][m] for light in lights), BETTER[m]) for m in figures[lights[0]]]
    print_table(("on a sphere", *lights, ""), rows, texts=1)
    counts = f"over {counted(comparison.angles.count, 'pair', 'pairs')} of directions"
    for where in [where for where in figures if where not in lights]:
        say("")
        rows = [(measure, value, BETTER[measure]) for measure, value in figures[where].items()]
        print_table((counts if where == "angles" else where, "", ""), rows, texts=1)
    return figures


def _textures(reference: Path, other: Path, output: Path, chosen: dict[str, Any]) -> None:
    from contextlib import ExitStack

    from nacre.figures.texture_sheet import (
        texture_rows,
        texture_scale,
        texture_sheet,
        texture_verdict,
    )
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
    pictures = texture_rows(textures[0], textures[1])
    scale, judgment = texture_scale(pictures), texture_verdict(pictures)
    write_bytes(
        texture_sheet(textures[0], textures[1], (reference.name, other.name), pictures), output
    )
    worst = [{"x": x, "y": y, "MSE x 1e4": 1e4 * mse} for x, y, mse in found.worst()]
    shown, by_view = found.errors.shown()
    rows = [("pairs compared", found.compared), *shown.items()]
    print_facts(f"{other.name} against {reference.name}", rows, UNITS)
    say("")
    print_table(("views", "MSE x 1e4"), by_view.items())
    say("")
    print_table(
        ("worst texels (x, y)", "MSE x 1e4"),
        [(f"{w['x']}, {w['y']}", w["MSE x 1e4"]) for w in worst],
    )
    facts = keyed({"pairs compared": found.compared, **found.errors.facts()}, UNITS)
    judged = {"worst texels": worst, "color scale end": scale, "verdict": judgment.facts()}
    text = f"{output}: reference | other | difference, whose colors end at {scale:g} here"
    report(text, _names(reference, other, output) | facts | keyed(judged))
    conclude(judgment)
