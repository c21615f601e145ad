from __future__ import annotations

import sys
from pathlib import Path

import click

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.fitting import note_inputs
from nacre.cli.options import option
from nacre.cli.report import note, progress, report_file
from nacre.errors import FormatError
from nacre.io.files import file_errors


@make(
    "bsdf",
    options.argument("source", click.Path(allow_dash=True), metavar="INPUT"),
    options.output_option("File to write: a table, or a network (.safetensors, .h5)."),
    option("--bsdf name", metavar="ID", help="BSDF to measure in a scene that has several."),
    options.resolution_option(),
    options.preset_option(),
    options.seed_option(),
)
def command(
    source: str,
    output: Path,
    name: str | None,
    resolution: tuple[int, ...] | None,
    preset: str,
    seed: int,
) -> None:
    """Measure a Mitsuba BSDF virtually, and write a table or a fitted network.

    INPUT is a description for mitsuba.load_dict in JSON: the text itself, such as '{"type":
    "principled", "roughness": 0.3}', a .json file, or - for standard input. It may also be a scene
    (.xml). Textures are read at one point, their center.
    """
    from nacre.formats import check_target, target, writer
    from nacre.measuring.bsdf import described_bsdf, scene_bsdf

    scene = source.lower().endswith(".xml")
    if name is not None and not scene:
        raise click.UsageError("--bsdf is for a scene (.xml)")
    write = writer(output, resolution)
    file = scene or source.lower().endswith(".json")
    options.check_outputs([output], [Path(source)] if file else [])
    line = progress(output.stem, "loading Mitsuba")
    brdf = scene_bsdf(source, name) if scene else described_bsdf(*_text(source, file=file))
    missing = brdf.left_out()
    brdf = brdf.replaced(name=output.stem)
    check_target(output, brdf)
    if target(output).holds == "neural":
        from nacre.neural import Recipe
        from nacre.workflows import NetworkFitting

        fitting = NetworkFitting(Recipe.preset(preset, seed=seed), ending=output.suffix)
        write(fitting.fit(brdf, line), output)
        note_inputs(fitting, output)
    else:
        line("measuring", 0, 1)
        write(brdf, output)
    if missing:
        note(f"{output}: without {' and '.join(missing)}")
    report_file(output, "", left_out=missing)


def _text(source: str, *, file: bool) -> tuple[str, str]:
    """A description, and its name in errors."""
    if source == "-":
        return sys.stdin.read(), "standard input"
    if not file:
        return source, "INPUT"
    try:
        with file_errors(source):
            return Path(source).read_text("utf-8"), source
    except UnicodeDecodeError as error:
        raise FormatError(f"{source}: is not text in UTF-8") from error
