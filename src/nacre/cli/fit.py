from __future__ import annotations

from pathlib import Path
from typing import Any

import click
from click import IntRange

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.fitting import fit_reflectances, fit_texture
from nacre.cli.kinds import kind_of
from nacre.cli.options import option
from nacre.errors import FormatError


@make(
    "fit",
    options.inputs_argument(),
    option("-o --output", click.Path(), shown="NAME.safetensors; NAME.json for an analytic model"),
    "File to write (.safetensors or .h5; .json for an analytic model), or a folder/.",
    option("--model", applies="brdf", default="nbrdf", metavar="NAME"),
    "Model to fit: nbrdf (a network), an analytic model (ggx, sgd, ...) or a standard material "
    "(openpbr, principled, gltf, closures). An unknown name lists all.",
    option(
        "--gain", options.positive(1e6), applies="brdf", shown="32 with enhanced inputs, else 1"
    ),
    "Weight of dark values in the loss; above 1, they count more.",
    option(
        "--inputs",
        ["enhanced", "paper", "stereographic"],
        applies="network",
        shown="enhanced; paper for scans and .h5 files",
    ),
    "Inputs of the network. enhanced: stretched angles, more accurate at half the size. paper: "
    "half and difference vectors, which the authors' tools read. stereographic: light and view, "
    "as in networks for textures; blurs highlights.",
    option("--physical", applies="network", is_flag=True),
    "Fit a network that is reciprocal and positive and reflects no more light than it receives; "
    "it has its own inputs.",
    option("--hidden", options.integers("21,21", most=1024), applies="network", default="21,21"),
    "Widths of the hidden layers.",
    option("--max-bytes", IntRange(64, 1 << 20), applies="network", metavar="BYTES"),
    "Size limit of the weights, instead of --hidden: two layers as wide as it allows.",
    options.precision_option(shown="half with enhanced inputs, else single"),
    "Precision of the stored weights, or of a texture's codes: 4 or 2 bytes each.",
    options.preset_option(applies="network"),
    option("--epochs", IntRange(1), applies="network", shown="the preset's"),
    "Passes over the samples.",
    option(
        "--samples",
        IntRange(1000, 100_000_000),
        applies="brdf",
        shown="800000; 4000000 for anisotropic materials and stereographic inputs; an eighth of "
        "that for drafts; 40000 for analytic models",
    ),
    "Samples to draw from the material.",
    option(
        "--sampling", ["mixed", "rusinkiewicz", "hemisphere"], applies="network", default="mixed"
    ),
    "Distribution of training directions: uniform in Rusinkiewicz angles, dense around highlights, "
    "as in the paper; uniform over the hemisphere; or half the first, half as in pictures (mixed).",
    option("--prior/--no-prior", applies="network", default=True),
    "Use what other materials are like when fitting up to 200 samples, and store how certain the "
    "result is.",
    options.scale_option(applies="network"),
    options.seed_option(applies="brdf"),
    options.jobs_option(applies="brdf"),
    options.device_option(applies="network"),
    option("--scheduler", applies="brdf", metavar="ADDRESS"),
    "Dask cluster to fit on (extra: cluster): tcp://HOST:8786, or local for processes on this "
    "machine. See docs/guide/clusters.md.",
    option("--data", ["auto", "path", "content"], applies="brdf", default="auto"),
    "Delivery of measured files to a cluster: by path, by content, or by content to workers that "
    "lack the file (auto).",
    options.codec_option(applies="btf"),
    options.directions_option(applies="btf", metavar="LIST"),
    "List of directions (.csv) for a folder of images, if not directions.csv inside it.",
    option("--embed/--no-embed", applies="btf", default=True),
    "Write the codec into the file, or only its name; unless it is the included one, it must then "
    "stay beside the file.",
    option("--texels-per-block", IntRange(1), applies="btf", shown="256 MB of values"),
    "Texels held in memory at a time.",
    option("--resume", applies="btf", is_flag=True),
    "Resume the same command where it stopped.",
    options.pixels_option(applies="btf"),
    plans=True,
)
def command(paths: tuple[Path, ...], output: str | None, **chosen: Any) -> None:
    """Fit a neural material to each INPUT: a network to a reflectance, codes to a texture.

    For a folder, every measured file in it and below is fitted, into a folder with a manifest: a
    later run fits only what has changed.

    A texture is a file, a folder of images, or a list of photographs (.csv). Its texels become
    short codes, which commands decode when they use the texture. A stopped fit of a texture keeps
    its state beside the output: --resume continues it.
    """
    kinds = {_kind(path, alone=len(paths) == 1) for path in paths}
    if kinds == {"brdf"}:
        fit_reflectances(paths, output, chosen)
    elif len(paths) == 1:
        fit_texture(paths[0], output, chosen)
    else:
        raise click.UsageError("fit one texture at a time, and not together with reflectances")


def _kind(path: Path, *, alone: bool) -> str:
    """The kind of an input; the fit of reflectances deals with folders and bad files."""
    if options.is_given("directions"):
        options.refuse(("brdf", "network"), "--directions is for textures")
        return "btf"
    try:
        return kind_of(path, refusing=alone)
    except FormatError:
        return "brdf"
