"""Reading a large `.btf` file block after block, beside the matrix products alone.

A file of the directions of Bonn and random factors is written first: nobody has to hold what it
decodes to, 18 GB of float32 at 256 x 256 texels. `python -m benchmarks.btf_file --help`.
"""

from __future__ import annotations

import argparse
import resource
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.table import markdown
from nacre.btf import BONN
from nacre.btf.ubo2014 import ColorModel, Ubo2014Btf, load
from nacre.btf.ubo2014.color_models import Decorrelation
from nacre.btf.ubo2014.header import CHANNELS, SCALARS, Factors, Header, pack, pack_factors
from nacre.geometry import split, to_spherical
from nacre.parallel import core_count

ROUNDS = 3


def write(path: Path, edge: int, components: int, model: ColorModel) -> None:
    """A file of `edge` x `edge` texels with factors that give logarithms of plausible size."""
    random = np.random.default_rng(0)
    angles = np.stack(to_spherical(split(BONN.directions)), axis=-1)
    lights = np.broadcast_to(angles, (len(angles), *angles.shape))
    header = Header(edge, edge, angles, lights, Decorrelation(model))
    scalar, texels = SCALARS[2], header.texel_count
    with path.open("wb") as file:
        file.write(pack(header, components))
        for _ in range(CHANNELS):
            file.write(pack_factors(Factors(scalar, components, header.pair_count, texels, 0)))
            for rows in (1, header.pair_count, texels):
                numbers = random.standard_normal((rows, components), np.float32)
                file.write((0.3 * numbers).astype(scalar).tobytes())


def products(btf: Ubo2014Btf, blocks: list[slice]) -> float:
    """Seconds of the matrix products alone, on factors that are float32 already."""
    factors = [btf.factors(channel) for channel in range(CHANNELS)]
    pairs = [pair.astype(np.float32) for pair, _ in factors]
    texels = [[texel[b].astype(np.float32) for _, texel in factors] for b in blocks]
    out = np.empty((len(texels[0][0]), btf.pair_count), np.float32)
    start = time.perf_counter()
    for block in texels:
        for texel, pair in zip(block, pairs, strict=True):
            np.matmul(texel, pair.T, out=out[: len(texel)])
    return time.perf_counter() - start


def reading(btf: Ubo2014Btf, blocks: list[slice]) -> float:
    """Seconds of decoding blocks of texels from the file."""
    start = time.perf_counter()
    for block in blocks:
        btf.texels(block)
    return time.perf_counter() - start


def main() -> None:
    """Print a Markdown table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--edge", type=int, default=256, help="texels of a row (default: 256)")
    parser.add_argument("--components", type=int, default=64, help="of a channel (default: 64)")
    parser.add_argument("--blocks", type=int, default=8, help="of texels that are read")
    options = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        files: dict[ColorModel, Ubo2014Btf] = {}
        for model in (ColorModel.RGB, ColorModel.YLOG_UDIVY_VDIVY):
            path = Path(folder) / f"{model.name}.btf"
            write(path, options.edge, options.components, model)
            start = time.perf_counter()
            files[model] = btf = load(path)
            opened = time.perf_counter() - start
        blocks = list(btf.blocks(1 << 27))[: options.blocks]
        values = 3 * btf.pair_count * blocks[-1].stop
        plain: list[float] = []
        decoded: dict[ColorModel, list[float]] = {model: [] for model in files}
        for _ in range(ROUNDS):
            plain.append(products(btf, blocks))
            for model, one in files.items():
                decoded[model].append(reading(one, blocks))
                print(f"{model.name}: {decoded[model][-1]:.2f} s", file=sys.stderr, flush=True)
        best = min(plain)
        rows.append(("matrix products alone", f"{best:.2f}", f"{values / best / 1e6:.0f}", "1.00"))
        for model, seconds in decoded.items():
            taken = min(seconds)
            label = f"read, color model {int(model)}"
            rows.append(
                (label, f"{taken:.2f}", f"{values / taken / 1e6:.0f}", f"{best / taken:.2f}")
            )
        size = path.stat().st_size / 2**20
    print(markdown(("", "s", "million values/s", "of matrix products"), rows))
    whole = 12 * btf.pair_count * btf.texel_count / 2**30
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**10
    print(
        f"\n{options.edge} x {options.edge} texels, {btf.pair_count:,} pairs, "
        f"{options.components} components; file of {size:.0f} MiB, {whole:.1f} GiB decoded; "
        f"opened and checked in {opened:.2f} s; peak {peak:.0f} MiB; {core_count()} cores."
    )


if __name__ == "__main__":
    main()
