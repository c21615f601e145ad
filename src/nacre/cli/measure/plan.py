from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.measure.instrument import instrument, instrument_options
from nacre.cli.options import option
from nacre.cli.ranges import IntRange
from nacre.cli.report import counted, progress, report_file
from nacre.errors import FormatError


@make(
    "plan",
    options.output_option("Table to write (.csv), with empty cells for f_r.", text=".csv"),
    option("-n --count", IntRange(1, 256), default=16),
    "Number of pairs of directions, or pictures. A larger plan begins with the smaller ones.",
    option("--of source", options.INPUT, metavar="MATERIAL"),
    "Material to measure virtually, which fills in the cells.",
    options.basis_option(),
    *instrument_options(),
)
def command(output: Path, count: int, source: Path | None, basis_name: str, **chosen: Any) -> None:
    """Plan the directions that tell most about an isotropic material.

    They suit materials like those of the basis. Fill in f_r in 1/sr on as many rows as you like, as
    r, g and b, as f alone or as bands, and pass the file to 'nacre fit', 'nacre latent encode' or
    'nacre measure next'.
    """
    from nacre.formats import load_brdf
    from nacre.latent import find_basis
    from nacre.latent.hypernetwork import neural_basis
    from nacre.measured.comma_separated import save, save_plan
    from nacre.measured.scattered import ScatteredBrdf
    from nacre.measuring import Design

    if output.suffix.lower() != ".csv":
        raise FormatError(f"{output}: a plan is a .csv file")
    options.check_outputs([output], [Path(basis_name), source])
    reached = instrument(chosen)
    line = progress(output.stem, "reading")
    basis = neural_basis(find_basis(basis_name))
    exposures = reached.exposures()
    if count > len(exposures):
        raise click.UsageError(f"the instrument reaches only {len(exposures)} pairs, not {count}")
    design = Design(basis, basis.examples, exposures)
    for index in range(count):
        design.choose()
        line("choosing", index + 1, count)
    wi, wo = (w[design.chosen].reshape(-1, 3) for w in (exposures.wi, exposures.wo))
    if source is not None:
        truth = load_brdf(source)
        save(ScatteredBrdf(wi, wo, truth.eval(wi, wo), truth.name), output)
    else:
        header = [f"rows of a picture: {exposures.pairs}"] if exposures.pairs > 1 else []
        save_plan(wi, wo, output, name=output.stem, header=header)
    text = counted(count, "pair of directions", "pairs of directions")
    if exposures.pairs > 1:
        text = counted(count, "picture", "pictures")
    report_file(output, text, pairs=len(wi))
