from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.options import option
from nacre.cli.report import keyed, progress, report_file


@make(
    "encode",
    options.argument("source", metavar="INPUT"),
    options.output_option("Code to write (.json); - is standard output.", text=".json"),
    options.basis_option(),
    option("--refine/--no-refine", default=True),
    "Refine the code so that pictures match. Unrefined, a pca code is the closest in the "
    "logarithm, an autoencoder's the output of its encoder; other bases always refine.",
    options.scale_option(),
    reads=True,
)
def command(source: Path, output: Path, basis_name: str, refine: bool, free_scale: bool) -> None:
    """Find the code of an isotropic material.

    For measurements at scattered directions, even a few, it also reports how well they determine
    the material.
    """
    from nacre.formats import load_brdf
    from nacre.latent import find_basis, save_code
    from nacre.latent.estimates import estimate, in_words
    from nacre.measured.scattered import ScatteredBrdf

    if output.suffix.lower() != ".json":
        raise click.BadParameter(f"{output}: a code is a .json file")
    options.check_outputs([output], [source, Path(basis_name)])
    line = progress(source.stem, "reading")
    basis = find_basis(basis_name)
    brdf = load_brdf(source)
    line("encoding", 0, 1)
    known: dict[str, Any] = {}
    if basis.takes_samples and isinstance(brdf, ScatteredBrdf) and brdf.isotropic:
        found = estimate(brdf, basis, free_scale=free_scale)
        material, known = found.material, found.facts()
    elif free_scale:
        raise click.UsageError("--free-scale is for samples at scattered directions")
    else:
        material = basis.decode(basis.encode(brdf, refine=refine), brdf.name)
    save_code(material, output)
    count = len(material.code)
    text = f"{count} values ({4 * count} bytes){in_words(known)}"
    report_file(output, text, code_dim=count, code_bytes=4 * count, **keyed(known))
