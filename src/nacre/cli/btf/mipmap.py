"""`nacre btf mipmap`."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np

from nacre.cli.btf.kinds import expect
from nacre.cli.btf.options import angles
from nacre.cli.console import Stages, check_outputs, console, file_path, print_json, print_table

if TYPE_CHECKING:
    from nacre.array import Floats
    from nacre.textures.mipmap import Filter

_LIGHT, _VIEW = (30.0, 0.0), (0.0, 0.0)
_PAIRS = 64
"""Pairs of directions that errors are of."""
_EDGE = 128
"""Pixels of the longer edge of each level's picture, at least."""


@click.command("mipmap")
@click.argument("source", type=file_path())
@click.option("-o", "--output", type=file_path(), help="Picture to write (.png, .jpg, .exr).")
@click.option(
    "--filter",
    "by",
    default="reflectance",
    show_default=True,
    type=click.Choice(["reflectance", "codes"]),
    help="What is averaged: what codes decode to, which is encoded again; or codes.",
)
@click.option("--light", callback=angles, metavar="THETA,PHI", help="In degrees.  [default: 30,0]")
@click.option("--view", callback=angles, metavar="THETA,PHI", help="In degrees.  [default: 0,0]")
@click.option("--json", "as_json", is_flag=True, help="One object, as JSON.")
def command(
    source: Path,
    output: Path | None,
    by: Filter,
    light: tuple[float, float] | None,
    view: tuple[float, float] | None,
    as_json: bool,
) -> None:
    """Filter the encoded texture at SOURCE for views from afar, and tell how well that stands.

    Errors are of reflectance factors, against means of what the texture decodes to, at directions
    drawn at random from those of the texture. The picture has the levels from left to right, all of
    one size: above means of decoded values, below what filtered codes decode to.
    """
    from nacre.measured.textures.directions import from_degrees
    from nacre.render.preview import check_image_path, write_image
    from nacre.textures.latent_file import load_latent_map
    from nacre.textures.mipmap import LatentPyramid, filtered_reflectance

    if output is not None:
        check_image_path(output)
        check_outputs([output], [source])
    expect(source, "an encoded texture")
    latent = load_latent_map(source)
    began = time.monotonic()
    with Stages() as stages:
        pyramid = LatentPyramid.build(latent, by, progress=stages.add(source.stem))
    seconds = time.monotonic() - began
    count = len(latent.wi)
    chosen = np.random.default_rng(1).choice(count, min(_PAIRS, count), replace=False)
    shown = [from_degrees(*w).astype(np.float32)[None] for w in (light or _LIGHT, view or _VIEW)]
    wi, wo = (
        np.concatenate([w[chosen], extra])
        for w, extra in zip((latent.wi, latent.wo), shown, strict=True)
    )
    decode = latent.codec.decoder(wi, wo)
    truths = filtered_reflectance(latent, wi, wo)
    rows, pictures = [], []
    for level, (codes, truth) in enumerate(zip(pyramid.levels[1:], truths, strict=True), 1):
        found = decode(codes.reshape(-1, codes.shape[2])).reshape(truth.shape)
        pictures.append((truth[:, :, -1], found[:, :, -1]))
        errors = np.square(found - truth)[:, :, :-1]
        relative = float(np.sqrt(errors.mean() / np.square(truth[:, :, :-1]).mean()))
        height, width = codes.shape[:2]
        rows.append((level, f"{width} x {height}", 1e4 * float(errors.mean()), relative))
    if output is not None and pictures:
        write_image(_sheet(pictures), output)
    columns = "level", "texels", "MSE x 1e4", "relative RMSE"
    if as_json:
        levels = [dict(zip(columns, row, strict=True)) for row in rows]
        print_json({"file": str(source), "filter": by, "seconds": seconds, "levels": levels})
        return
    print_table(columns, ((str(row[0]), *row[1:]) for row in rows))
    console.print(f"{source}: filtered in {seconds:.2g} seconds", markup=False)
    if output is not None:
        console.print(
            f"{output}: means of decoded values above, filtered codes below", markup=False
        )


def _sheet(pictures: list[tuple[Floats, Floats]]) -> Floats:
    """Pairs of pictures, each repeated to about one size, in columns."""
    columns = []
    height, width = (
        max(n, _EDGE * n // max(pictures[0][0].shape[:2])) for n in pictures[0][0].shape[:2]
    )
    for pair in pictures:
        rows = [
            picture[
                np.arange(height)[:, None] * len(picture) // height,
                np.arange(width) * picture.shape[1] // width,
            ]
            for picture in pair
        ]
        columns.append(np.pad(np.concatenate(rows), ((0, 0), (0, 4), (0, 0)), constant_values=1.0))
    return np.concatenate(columns, axis=1)[:, :-4]
