"""`nacre latent decode`."""

from __future__ import annotations

from pathlib import Path

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.progress import progress
from nacre.cli.report import report_file


@make(
    "decode",
    options.argument("source", metavar="CODE"),
    options.output_option(),
    "Material to write (.binary, .bsdf, ...); networks of a hypernetwork or an autoencoder, "
    "which have the paper's inputs, also as .safetensors and .h5.",
    options.basis_option(),
)
def command(source: Path, output: Path, basis_name: str) -> None:
    """Write the material that a code stands for, in the format that the output's name ends in."""
    from nacre.formats import check_target, writer
    from nacre.latent import find_basis, load_code

    write = writer(output)
    options.check_outputs([output], [source, Path(basis_name)])
    line = progress(source.stem, "decoding")
    material = load_code(source, find_basis(basis_name))
    check_target(output, material)
    line("writing", 0, 1)
    write(material, output)
    report_file(output, "")
