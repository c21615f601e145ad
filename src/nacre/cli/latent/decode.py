from __future__ import annotations

from pathlib import Path

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.report import progress, report_file


@make(
    "decode",
    options.argument("source", metavar="CODE"),
    options.output_option(),
    "Material to write (.binary, .bsdf, ...); a hypernetwork or an autoencoder also gives networks "
    "with the paper's inputs (.safetensors, .h5).",
    options.basis_option(),
)
def command(source: Path, output: Path, basis_name: str) -> None:
    """Decode a code into a material; the output's ending chooses the format."""
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
