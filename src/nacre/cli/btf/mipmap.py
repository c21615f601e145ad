from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.kinds import expect
from nacre.cli.options import option
from nacre.cli.report import keyed, print_table, progress, report

if TYPE_CHECKING:
    from nacre.array import Floats
    from nacre.textures.codecs.codec import Filter

_PAIRS = 64
"""Pairs of directions at which errors are computed."""
_EDGE = 128
"""Least number of pixels along the longer edge of each level's picture."""


@make(
    "mipmap",
    options.argument("source", metavar="CODES"),
    options.output_option("Picture to write (.png, .jpg, .exr).", required=False),
    option(
        "--filter by",
        ["reflectance", "codes"],
        shown="as suits the codec",
    ),
    "Quantity to average: reflectance, which is then encoded again, or codes.",
    option("--wi", options.DIRECTION, default="30,0", help="Direction to the light, in degrees."),
    option("--wo", options.DIRECTION, default="0,0", help="Direction to the viewer, in degrees."),
)
def command(
    source: Path,
    output: Path | None,
    by: Filter | None,
    wi: tuple[float, float],
    wo: tuple[float, float],
) -> None:
    """Filter an encoded texture for distant views, and report the error.

    The error compares decoded filtered codes with averages of the decoded texture, as reflectance
    factors at random directions of the texture. The picture shows the levels from left to right at
    the same size, averages of decoded values above and decoded filtered codes below.
    """
    from nacre.measured.textures.directions import from_degrees
    from nacre.mitsuba.preview import check_image_path, write_image
    from nacre.textures.latent_file import load_latent_map
    from nacre.textures.mipmap import LatentPyramid, filtered_reflectance

    if output is not None:
        check_image_path(output)
        options.check_outputs([output], [source])
    expect(source, "an encoded texture")
    latent = load_latent_map(source)
    by = by or latent.codec.filtered_by
    began = time.monotonic()
    pyramid = LatentPyramid.build(latent, by, progress=progress(source.stem))
    seconds = time.monotonic() - began
    count = len(latent.wi)
    chosen = np.random.default_rng(1).choice(count, min(_PAIRS, count), replace=False)
    shown = [from_degrees(*w).astype(np.float32)[None] for w in (wi, wo)]
    light, view = (
        np.concatenate([w[chosen], extra])
        for w, extra in zip((latent.wi, latent.wo), shown, strict=True)
    )
    decode = latent.codec.decoder(light, view)
    truths = filtered_reflectance(latent, light, view)
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
    print_table(columns, ((str(row[0]), *row[1:]) for row in rows))
    lines = [f"{source}: filtered by {by} in {seconds:.2g} seconds"]
    if output is not None:
        lines.append(f"{output}: averages of decoded values above, filtered codes below")
    levels = [keyed(dict(zip(columns, row, strict=True))) for row in rows]
    report(lines, {"file": str(source), "filter": by, "seconds": seconds, "levels": levels})


def _sheet(pictures: list[tuple[Floats, Floats]]) -> Floats:
    """Pairs of pictures in columns, their pixels repeated to about one size."""
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
