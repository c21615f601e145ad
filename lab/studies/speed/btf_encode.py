"""Encoding a texture of half floats with the default codec, beside its matrix products alone.

Both take turns, block by block, on the cores that the encoder uses: the whole of
:func:`nacre.workflows.encoding.encode`, from values in memory to codes and their errors; and one
BLAS product of the same shapes for each that the encoder does, on float32 numbers that lie ready,
128 texels at a time on every core as there.
`python -m lab.studies.speed.btf_encode --help`.
"""

from __future__ import annotations

import statistics
import time
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from lab.studies.speed.btf_train import codec_multiply_adds
from lab.studies.study import Study, log
from nacre.array import Floats
from nacre.btf import TableBtf
from nacre.measured.textures import BONN
from nacre.runtime.parallel import core_count, thread_map
from nacre.textures.codecs.basis.codec import BasisCodec
from nacre.textures.codecs.codec_file import PUBLISHED, load_codec
from nacre.workflows.encoding import BLOCK, encode

PART = 128
"""Texels that a core takes at a time."""
STEPS = 2
"""Gauss-Newton steps of a code."""


class Times(NamedTuple):
    """Seconds of a block of texels, and of processor time of all threads."""

    whole: float
    products: float
    whole_used: float
    products_used: float


def texture(edge: int) -> TableBtf:
    """Random reflectance in half precision."""
    wi, wo = BONN.pairs()
    random = np.random.default_rng(0)
    few = random.random((edge, len(wi), 3), np.float32).astype(np.float16)
    values = np.empty((edge, edge, len(wi), 3), np.float16)
    for row in values:
        row[:] = few[random.permutation(edge)]
    return TableBtf(values, wi, wo)


def products(codec: BasisCodec, pairs: int) -> Callable[[int], None]:
    """What does the products of so many texels on all cores."""
    random = np.random.default_rng(1)

    def matrix(*shape: int) -> Floats:
        return random.random(shape, np.float32)

    functions, count, values = codec.functions, codec.expanded_dim, codec.code_dim
    factors = [
        (matrix(PART, pairs), matrix(pairs, functions.luma_count)),
        (matrix(2 * PART, pairs), matrix(pairs, functions.chroma_count)),
        *[(matrix(PART, count), matrix(count, count))] * 3,
    ]
    networks = [codec.complete]
    if not codec.decode.is_identity:
        networks += [codec.encode, *[codec.decode] * (STEPS + 2)]
        _, *others = codec.decode.layers
        slopes = [(matrix(PART * values, len(w)), w) for w, _ in others]
        curvature = [(matrix(values, count), matrix(count, values))] * PART
        factors += [*slopes, *curvature] * STEPS
    for network in networks:
        for weights in (network.linear, *(layer.weights for layer in network.layers)):
            factors.append((matrix(PART, len(weights)), weights))

    def one_core(texels: float) -> None:
        results = [np.empty((len(a), b.shape[1]), np.float32) for a, b in factors]
        for _ in range(round(texels / PART)):
            for (a, b), result in zip(factors, results, strict=True):
                np.matmul(a, b, out=result)

    def run(texels: int) -> None:
        cores = core_count()
        deque(thread_map(one_core, [texels / cores] * cores), 0)

    return run


def timed(btf: TableBtf, codec: BasisCodec, run: Callable[[int], None]) -> list[Times]:
    """Of every block but the first, before which functions are evaluated, and the last."""
    step = BLOCK // (12 * btf.pair_count)
    found: list[Times] = []

    def now() -> tuple[float, float]:
        return time.perf_counter(), time.process_time()

    began = now()

    def progress(stage: str, done: int, total: int, text: str) -> None:
        nonlocal began
        ended = now()
        run(step)
        after = now()
        whole, used = (b - a for a, b in zip(began, ended, strict=True))
        alone, alone_used = (b - a for a, b in zip(ended, after, strict=True))
        if step < done < total:
            found.append(Times(whole, alone, used, alone_used))
            log(f"{done} of {total} texels: {whole:.3f} s, products {alone:.3f} s")
        began = now()

    encode(btf, codec, progress=progress)
    return found


def main() -> None:
    """Print a Markdown table."""
    study = Study(__doc__, __file__)
    study.add_argument("--edge", type=int, default=128, help="texels of a row (default: 128)")
    options = study.options()
    btf, codec = texture(options.edge), load_codec(PUBLISHED)
    assert isinstance(codec, BasisCodec)
    step = BLOCK // (12 * btf.pair_count)
    rows = []
    for label, one in (("codes of 32 values", codec), ("128 coefficients", codec.expanded())):
        times = timed(btf, one, products(one, btf.pair_count))
        whole, alone, *_ = (statistics.median(t) for t in zip(*times, strict=True))
        values = 3 * btf.pair_count * step
        work = codec_multiply_adds(one, btf.pair_count)[0] * step
        rows.append(
            (
                label,
                f"{1e3 * whole:.0f}",
                f"{1e3 * whole / step:.3f}",
                f"{values / whole / 1e6:.0f}",
                f"{1e3 * alone:.0f}",
                f"{work / alone / 1e9:.0f}",
                f"{statistics.median(t.products / t.whole for t in times):.2f}",
                f"{statistics.median(t.products_used / t.whole_used for t in times):.2f}",
            )
        )
    columns = ("", "ms a block", "ms a texel", "million values/s", "products alone, ms")
    study.table(
        (*columns, "billion multiply-adds/s of these", "of their speed", "by processor time"),
        rows,
        note=f"{options.edge} x {options.edge} texels, {btf.pair_count:,} pairs, half precision; "
        f"blocks of {step} texels; {core_count()} cores.",
    )


if __name__ == "__main__":
    main()
