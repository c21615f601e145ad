"""`nacre latent encode`."""

from __future__ import annotations

from pathlib import Path

import click

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.options import option
from nacre.cli.progress import progress
from nacre.cli.report import report_file


@make(
    "encode",
    options.argument("source", metavar="INPUT"),
    options.output_option("Code to write (.json); - is standard output.", text=".json"),
    options.basis_option(),
    option("--refine/--no-refine", default=True),
    "Refine the code for pictures. Without, a pca code is closest in the logarithm, and an "
    "autoencoder's is what its encoder gives; the others have no such code.",
)
def command(source: Path, output: Path, basis_name: str, refine: bool) -> None:
    """Find the code of an isotropic material."""
    from nacre.formats import load_brdf
    from nacre.latent import find_basis, save_code

    if output.suffix.lower() != ".json":
        raise click.BadParameter(f"{output}: a code is a .json file")
    options.check_outputs([output], [source, Path(basis_name)])
    line = progress(source.stem, "reading")
    basis = find_basis(basis_name)
    brdf = load_brdf(source)
    line("encoding", 0, 1)
    code = basis.encode(brdf, refine=refine)
    save_code(basis.decode(code, brdf.name), output)
    text = f"{len(code)} values ({4 * len(code)} bytes)"
    report_file(output, text, code_dim=len(code), code_bytes=4 * len(code))
