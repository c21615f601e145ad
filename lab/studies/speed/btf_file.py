"""Reading a large `.btf` file block after block, beside the matrix products alone.

A file of the directions of Bonn and random factors is written first: nobody has to hold what it
decodes to, 18 GB of float32 at 256 x 256 texels. `python -m lab.studies.speed.btf_file --help`.
"""

from __future__ import annotations

import resource
import statistics
import tempfile
import time
from pathlib import Path

import numpy as np

from lab.studies.study import Study
from nacre.geometry import split, to_spherical
from nacre.measured.textures import BONN
from nacre.measured.textures.ubo2014 import ColorModel, Ubo2014Btf, load
from nacre.measured.textures.ubo2014.color_models import Decorrelation
from nacre.measured.textures.ubo2014.header import (
    CHANNELS,
    SCALARS,
    Factors,
    Header,
    pack,
    pack_factors,
)
from nacre.runtime.parallel import core_count

BLOCK = 1 << 25
"""Bytes of values; memory of larger ones comes from the system anew each time, page by page."""


def write(path: Path, edge: int, components: int, model: ColorModel) -> None:
    """A file of `edge` x `edge` texels with factors that give logarithms of plausible size."""
    random = np.random.default_rng(0)
    angles = np.stack(to_spherical(split(BONN.directions)), axis=-1)
    lights = np.broadcast_to(angles, (len(angles), *angles.shape))
    header = Header(edge, edge, angles, lights, Decorrelation(model))
    scalar, texels = SCALARS[2], header.width * header.height
    with path.open("wb") as file:
        file.write(pack(header, components))
        for _ in range(CHANNELS):
            file.write(pack_factors(Factors(scalar, components, header.pair_count, texels, 0)))
            for rows in (1, header.pair_count, texels):
                numbers = random.standard_normal((rows, components), np.float32)
                file.write((0.3 * numbers).astype(scalar).tobytes())


def products(btf: Ubo2014Btf, block: slice) -> float:
    """Seconds of the matrix products alone, on factors that are float32 already."""
    factors = [btf.factors(channel) for channel in range(CHANNELS)]
    pairs = [pair.astype(np.float32) for pair, _ in factors]
    texels = [texel[block].astype(np.float32) for _, texel in factors]
    out = np.zeros((len(texels[0]), btf.pair_count), np.float32)
    start = time.perf_counter()
    for texel, pair in zip(texels, pairs, strict=True):
        np.matmul(texel, pair.T, out=out)
    return time.perf_counter() - start


def reading(btf: Ubo2014Btf, block: slice) -> float:
    """Seconds of decoding a block of texels from the file."""
    start = time.perf_counter()
    btf.texels(block)
    return time.perf_counter() - start


def main() -> None:
    """Print a Markdown table."""
    study = Study(__doc__, __file__)
    study.add_argument("--edge", type=int, default=256, help="texels of a row (default: 256)")
    study.add_argument("--components", type=int, default=64, help="of a channel (default: 64)")
    study.add_argument("--blocks", type=int, default=60, help="of texels that are read")
    options = study.options()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        files: dict[ColorModel, Ubo2014Btf] = {}
        for model in (ColorModel.RGB, ColorModel.YLOG_UDIVY_VDIVY):
            path = Path(folder) / f"{model.name}.btf"
            write(path, options.edge, options.components, model)
            start = time.perf_counter()
            files[model] = btf = load(path)
            opened = time.perf_counter() - start
        plain: list[float] = []
        decoded: dict[ColorModel, list[float]] = {model: [] for model in files}
        for block in [*btf.blocks(BLOCK)][1 : options.blocks + 1]:  # in turns: others work here too
            plain.append(products(btf, block))
            for model, one in files.items():
                decoded[model].append(reading(one, block))
        values = 3 * btf.pair_count * (block.stop - block.start)
        labels = ["matrix products alone", *(f"read, color model {int(m)}" for m in files)]
        for label, seconds in zip(labels, (plain, *decoded.values()), strict=True):
            taken = statistics.median(seconds)
            fraction = statistics.median(np.divide(plain, seconds))
            rows.append(
                (label, f"{1e3 * taken:.1f}", f"{values / taken / 1e6:.0f}", f"{fraction:.2f}")
            )
        size = path.stat().st_size / 2**20
    whole = 12 * btf.pair_count * btf.texel_count / 2**30
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**10
    study.table(
        ("", "ms a block", "million values/s", "of matrix products"),
        rows,
        note=f"{options.edge} x {options.edge} texels, {btf.pair_count:,} pairs, "
        f"{options.components} components; file of {size:.0f} MiB, {whole:.1f} GiB decoded; "
        f"opened and checked in {opened:.2f} s; peak {peak:.0f} MiB; {core_count()} cores.",
    )


if __name__ == "__main__":
    main()
