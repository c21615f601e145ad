"""`nacre fit`."""

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
    option("-o --output", click.Path(), shown="NAME.safetensors, of an analytic model NAME.json"),
    "File to write (.safetensors or .h5; .json of an analytic model), or a folder/.",
    option("--model", applies="brdf", default="nbrdf", metavar="NAME"),
    "Model to fit: nbrdf, a network; an analytic model: ggx, sgd, ...; or a standard material: "
    "openpbr, principled, gltf, closures, which are fitted to pictures. An unknown "
    "name lists them all.",
    option(
        "--gain", options.positive(1e6), applies="brdf", shown="32 with enhanced inputs, else 1"
    ),
    "Weight of dark values in the loss: more than 1 counts them more.",
    option(
        "--inputs",
        ["enhanced", "paper", "stereographic"],
        applies="network",
        shown="enhanced; paper for scans and .h5 files",
    ),
    "Inputs of the network. enhanced: stretched angles, closer at half the size. paper: half and "
    "difference vectors, which the authors' tools read. stereographic: light and view, as in "
    "networks for textures, for comparison; highlights blur.",
    option("--physical", applies="network", is_flag=True),
    "Fit a network that is reciprocal, positive, and reflects no more light than it gets. It has "
    "inputs of its own, as close as enhanced ones.",
    option("--hidden", options.integers("21,21", most=1024), applies="network", default="21,21"),
    "Widths of the hidden layers.",
    option("--max-bytes", IntRange(64, 1 << 20), applies="network", metavar="BYTES"),
    "Size limit of the weights, in place of --hidden: two layers as wide as it allows.",
    options.precision_option(shown="half with enhanced inputs, else single"),
    "Precision of stored weights, and of the codes of a texture: 4 or 2 bytes each.",
    options.preset_option(applies="network"),
    option("--epochs", IntRange(1), applies="network", shown="the preset's"),
    "Passes over the samples.",
    option(
        "--samples",
        IntRange(1000, 100_000_000),
        applies="brdf",
        shown="800000; 4000000 for anisotropic materials and stereographic inputs; an "
        "eighth of that for drafts; 40000 for analytic models",
    ),
    "Samples to draw from the material.",
    option(
        "--sampling", ["mixed", "rusinkiewicz", "hemisphere"], applies="network", default="mixed"
    ),
    "Distribution of training directions: uniform in the Rusinkiewicz angles, dense around "
    "highlights, as in the paper; uniform over the hemisphere; or half the first and half as "
    "pictures show them.",
    option("--prior/--no-prior", applies="network", default=True),
    "Fit measurements of up to 200 samples by what other materials are like, and keep how sure "
    "that is. Without, only the samples count.",
    *options.scale_option(applies="network"),
    options.seed_option(applies="brdf"),
    options.jobs_option(applies="brdf"),
    options.device_option(applies="network"),
    option("--scheduler", applies="brdf", metavar="ADDRESS"),
    "Dask cluster to fit on (extra: cluster): tcp://HOST:8786, or local for processes on this "
    "machine. See docs/guide/clusters.md.",
    option("--data", ["auto", "path", "content"], applies="brdf", default="auto"),
    "Way of measured files to a cluster: by the same path, by content, which is sent, or by "
    "content where a worker has no such file under the path.",
    options.codec_option(applies="btf"),
    options.directions_option(applies="btf", metavar="LIST"),
    "List of directions (.csv) of the images in a folder, if it is not directions.csv there.",
    option("--embed/--no-embed", applies="btf", default=True),
    "Write the codec into the file, or only its name: it must then stay beside the file, unless "
    "it is the included one.",
    option("--texels-per-block", IntRange(1), applies="btf", shown="256 MB of values"),
    "Texels in memory at a time.",
    option("--resume", applies="btf", is_flag=True),
    "Continue where the same command was stopped.",
    options.pixels_option(applies="btf"),
)
def command(paths: tuple[Path, ...], output: str | None, **chosen: Any) -> None:
    """Fit a neural material to each INPUT: a network to a reflectance, codes to a texture.

    Of a folder of materials, every measured file in it and below is fitted, into a folder with a
    manifest: a later run fits only what has changed.

    A texture is a file, a folder of images, or a list of photographs (.csv). Its texels become
    short codes; the result is a texture to all commands, decoded as it is used. A fit of a texture
    that was stopped keeps its state beside the output: --resume continues it.
    """
    kinds = {_kind(path, alone=len(paths) == 1) for path in paths}
    if kinds == {"brdf"}:
        fit_reflectances(paths, output, chosen)
    elif len(paths) == 1:
        fit_texture(paths[0], output, chosen)
    else:
        raise click.UsageError("fit one texture at a time, apart from reflectances")


def _kind(path: Path, *, alone: bool) -> str:
    """The kind of an input; folders of materials and bad files are left to fits of reflectances."""
    if options.is_given("directions"):
        options.refuse(("brdf", "network"), "--directions is given, which is for textures")
        return "btf"
    try:
        return kind_of(path, refusing=alone)
    except FormatError:
        return "brdf"
