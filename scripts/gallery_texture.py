"""Store an encoded texture for the gallery: `gallery_texture.py ENCODED CAPTURED OUTPUT [HEIGHTS]`.

Codes take 22 bytes a texel; errors of what is left of them, against what was captured at all pairs
of directions, are told and stored. Heights, as many a texel as there are, become their mean and lie
beside the output.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from nacre.formats import load_btf
from nacre.metrics.texture_errors import ErrorSums
from nacre.textures.codecs.codec import on_all_cores
from nacre.textures.height_file import read_heights, write_heights
from nacre.textures.latent_file import load_latent_map, save_latent_map
from nacre.textures.limit import Rate, limited

BLOCK = 4096  # texels at a time
RATE = Rate(22.0)


def main(encoded: str, captured: str, output: str, heights: str | None = None) -> None:
    """Write OUTPUT (.safetensors), and heights beside it (.exr) where there are some."""
    latent, table = load_latent_map(encoded), load_btf(captured)
    small = limited(latent, RATE)
    codes = latent.codes, small.codes
    decode = on_all_cores(latent.codec, latent.codec.decoder(table.wi, table.wo))
    errors = ErrorSums(), ErrorSums()
    for start in range(0, table.texel_count, BLOCK):
        part = slice(start, start + BLOCK)
        texels = table.texels(part)
        for sums, held in zip(errors, codes, strict=True):
            flat = held.reshape(table.texel_count, -1)[part].astype(np.float32)
            sums.add(texels, decode(flat), table.wo)
    before, facts = (sums.result().facts() for sums in errors)
    stored = latent.metadata | {"errors": facts | {"pairs compared a texel": table.pair_count}}
    save_latent_map(replace(small, metadata=stored), output)
    print(
        f"{output}: {Path(output).stat().st_size:,} bytes, MSE x 1e4 {facts['MSE x 1e4']:.4g} "
        f"(codes as they were {before['MSE x 1e4']:.4g})"
    )
    if heights is not None:
        write_relief(heights, latent.codes.shape[:2], Path(output).with_suffix(".exr"))


def write_relief(heights: str, shape: tuple[int, ...], output: Path) -> None:
    """Write the mean height of every texel."""
    height, width = shape
    fine = read_heights(heights)
    rows, columns = fine.shape[0] // height, fine.shape[1] // width
    blocks = fine.reshape(height, rows, width, columns)
    write_heights(np.asarray(blocks.mean(axis=(1, 3)), np.float32), output)
    print(f"{output}: {output.stat().st_size:,} bytes")


if __name__ == "__main__":
    if len(sys.argv) not in (4, 5):
        raise SystemExit(__doc__)
    main(*sys.argv[1:])
