"""`nacre fit`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.fitting import fit_reflectances, fit_texture
from nacre.cli.materials import kind_of
from nacre.errors import FormatError


class _Widths(options.Integers):
    """Widths of hidden layers."""

    def convert(self, value: Any, param: Any, ctx: Any) -> tuple[int, ...]:
        """See click."""
        widths = super().convert(value, param, ctx)
        if not all(1 <= width <= 1024 for width in widths):
            self.fail("expected up to 8 widths from 1 to 1024, like 21,21", param, ctx)
        return widths


@make("fit", writes=True, reports=True)
@options.inputs_argument("paths", metavar="INPUT...")
@options.option(
    "-o",
    "--output",
    type=click.Path(),
    show_default="NAME.safetensors, of an analytic model NAME.json",
    help="File to write (.safetensors or .h5; .json of an analytic model), or a folder/.",
)
@options.option(
    "--model",
    applies="brdf",
    default="nbrdf",
    metavar="NAME",
    help="Model to fit: nbrdf, a network, or an analytic model: ggx, ggx-anisotropic, ... An "
    "unknown name lists them all.",
)
@options.option(
    "--gain",
    applies="brdf",
    type=options.FiniteRange(0.0, 1e6, min_open=True),
    show_default="1; 32 with enhanced inputs",
    help="Weight of dark values in the loss: more than 1 counts them more.",
)
@options.option(
    "--inputs",
    applies="network",
    default="paper",
    type=click.Choice(["paper", "enhanced", "stereographic"]),
    help="Inputs of the network. paper: half and difference vectors, which the authors' tools "
    "read. enhanced: stretched angles, closer at the same size. stereographic: light and view, as "
    "in networks for textures, for comparison; highlights blur.",
)
@options.option(
    "--hidden",
    applies="network",
    default="21,21",
    type=_Widths("21,21"),
    help="Widths of the hidden layers.",
)
@options.option(
    "--max-bytes",
    applies="network",
    type=click.IntRange(64, 1 << 20),
    metavar="BYTES",
    help="Size limit of the weights, in place of --hidden: two layers as wide as it allows.",
)
@options.precision_option(
    show_default="single; half with enhanced inputs",
    help="Precision of stored weights, and of the codes of a texture: 4 or 2 bytes each.",
)
@options.preset_option(applies="network")
@options.option(
    "--epochs",
    applies="network",
    type=click.IntRange(1),
    show_default="the preset's",
    help="Passes over the samples.",
)
@options.option(
    "--samples",
    applies="brdf",
    type=click.IntRange(1000, 100_000_000),
    show_default="800000; 4000000 for anisotropic materials and stereographic inputs; an eighth "
    "of that for drafts; 40000 for analytic models",
    help="Samples to draw from the material.",
)
@options.option(
    "--sampling",
    applies="network",
    default="mixed",
    type=click.Choice(["mixed", "rusinkiewicz", "hemisphere"]),
    help="Distribution of training directions: uniform in the Rusinkiewicz angles, dense around "
    "highlights, as in the paper; uniform over the hemisphere; or half the first and half as "
    "pictures show them.",
)
@options.seed_option(applies="brdf")
@options.jobs_option(applies="brdf")
@options.device_option(applies="network")
@options.option(
    "--scheduler",
    applies="brdf",
    metavar="ADDRESS",
    help="Dask cluster to fit on (extra: cluster): tcp://HOST:8786, or local for processes on "
    "this machine. See docs/guide/clusters.md.",
)
@options.option(
    "--data",
    applies="brdf",
    default="auto",
    type=click.Choice(["auto", "path", "content"]),
    help="Way of measured files to a cluster: by the same path, by content, which is sent, or by "
    "content where a worker has no such file under the path.",
)
@options.codec_option(applies="btf")
@options.directions_option(
    applies="btf",
    metavar="LIST",
    help="List of directions (.csv) of the images in a folder, if it is not directions.csv there.",
)
@options.option(
    "--embed/--no-embed",
    applies="btf",
    default=True,
    help="Write the codec into the file, or only its name: it must then stay beside the file, "
    "unless it is the included one.",
)
@options.option(
    "--texels-per-block",
    applies="btf",
    type=click.IntRange(1),
    show_default="256 MB of values",
    help="Texels in memory at a time.",
)
@options.option(
    "--resume", applies="btf", is_flag=True, help="Continue where the same command was stopped."
)
@options.pixels_option(applies="btf")
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
