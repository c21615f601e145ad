from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import click

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.report import print_table, progress, report_file


@make(
    "project",
    options.argument("source", metavar="INPUT"),
    options.output_option("Code to write (.json); - is standard output.", text=".json"),
    options.basis_option(),
)
def command(source: Path, output: Path, basis_name: str) -> None:
    """Move a material or a code (.json) to the nearest plausible one.

    The result is the nearest code that is more plausible than the least plausible 5 % of the
    training materials. A material that already is plausible stays as it is.
    """
    from nacre.figures.code_views import coded
    from nacre.latent import find_basis, save_code
    from nacre.workflows import plausibility, project_material

    if output.suffix.lower() != ".json":
        raise click.BadParameter(f"{output}: a code is a .json file")
    options.check_outputs([output], [source, Path(basis_name)])
    line = progress(source.stem, "encoding")
    given = coded([source], find_basis(basis_name))[0]
    line("projecting", 0, 1)
    found = project_material(given)
    save_code(found, output)
    before, after = plausibility(given), plausibility(found)
    moved = float(((found.code - given.code) ** 2).sum() ** 0.5)
    print_table(
        ("", "log density", "more plausible than", "largest albedo"),
        (
            (word, f"{x.log_density:.1f}", f"{100.0 * x.typical:.0f} %", f"{x.albedo:.3f}")
            for word, x in (("before", before), ("after", after))
        ),
    )
    report_file(
        output, f"moved by {moved:.2f}", moved=moved, before=asdict(before), after=asdict(after)
    )
