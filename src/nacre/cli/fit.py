from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.fitting import fit_reflectances, fit_texture
from nacre.cli.kinds import kind_of
from nacre.cli.options import option
from nacre.cli.ranges import IntRange, positive
from nacre.errors import FormatError


@make(
    "fit",
    options.inputs_argument(),
    option("-o --output", click.Path(), shown="NAME.safetensors or NAME.json"),
    "File (.safetensors, .h5 or .json) or folder/ to write.",
    options.preset_option(applies="network", first=True),
    option("--model", applies="brdf", first=True, default="nbrdf", metavar="NAME"),
    "Model to fit: nbrdf (a network), spectral (one over wavelength), an analytic one (ggx, ...) "
    "or a standard one (openpbr, principled, gltf, closures). An unknown name lists all.",
    option("--physical", applies="network", first=True, is_flag=True),
    "Fit a network that is reciprocal, positive and energy-conserving.",
    option("--max-bytes", IntRange(64, 1 << 20), applies="network", first=True, metavar="BYTES"),
    "Size limit of the weights, instead of --hidden.",
    options.precision_option(shown="half with enhanced inputs, else single"),
    "Precision of weights or codes: 4 or 2 bytes each.",
    options.jobs_option(applies="brdf", first=True),
    options.device_option(applies="network", first=True),
    options.seed_option(applies="brdf", first=True),
    option(
        "--inputs",
        ["enhanced", "paper", "stereographic"],
        applies="network",
        metavar="KIND",
        shown="enhanced; paper for scans and .h5 files",
    ),
    "Inputs of the network. enhanced: more accurate at half the size. paper: for the authors' "
    "tools. stereographic: light and view; blurs highlights.",
    option("--hidden", options.integers("21,21", most=1024), applies="network", default="21,21"),
    "Widths of the hidden layers.",
    option("--epochs", IntRange(1), applies="network", shown="the preset's"),
    "Passes over the samples.",
    option(
        "--sampling",
        ["mixed", "rusinkiewicz", "hemisphere"],
        applies="network",
        metavar="KIND",
        default="mixed",
    ),
    "Training directions. rusinkiewicz: dense around highlights. hemisphere: uniform. "
    "mixed: half dense, half as in pictures.",
    option("--prior/--no-prior", applies="network", default=True),
    "Use what other materials are like for up to 200 samples, and store the uncertainty.",
    options.scale_option(applies="network"),
    option("--intervals", applies="network", is_flag=True),
    "Also store what a scan's uncertainties mean.",
    option(
        "--samples",
        IntRange(1000, 100_000_000),
        applies="brdf",
        shown="800,000; more if anisotropic, fewer for drafts",
    ),
    "Samples to draw.",
    option("--gain", positive(1e6), applies="brdf", shown="32 with enhanced inputs, else 1"),
    "Weight of dark values in the loss.",
    options.codec_option(applies="btf"),
    options.directions_option(applies="btf", metavar="LIST", shown="directions.csv in the folder"),
    "List of directions (.csv) for a folder of images.",
    options.pixels_option(applies="btf"),
    option("--embed/--no-embed", applies="btf", default=True),
    "Store the codec in the file; otherwise a codec of your own must stay beside it.",
    options.bytes_per_texel_option(applies="btf"),
    options.quality_option(applies="btf"),
    option("--texels-per-block", IntRange(1), applies="btf", shown="256 MB of values"),
    "Texels held at a time.",
    option("--resume", applies="btf", is_flag=True),
    "Resume the same command where it stopped.",
    option("--scheduler", group="a cluster", metavar="ADDRESS"),
    "Dask cluster (extra: cluster): tcp://HOST:8786, or local for processes on this machine.",
    option(
        "--data",
        ["auto", "path", "content"],
        group="a cluster",
        metavar="KIND",
        default="auto",
    ),
    "Delivery of measurements to workers: by path, content, or as suits each.",
    plans=True,
    reads=True,
)
def command(paths: tuple[Path, ...], output: str | None, **chosen: Any) -> None:
    """Fit a neural material to each INPUT: a network to a reflectance, codes to a texture.

    For a folder, every measured file in it and below is fitted, into a folder with a manifest: a
    later run fits only what has changed.

    A texture is a file, a folder of images, or a list of photographs (.csv).
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
