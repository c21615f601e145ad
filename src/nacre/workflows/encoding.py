"""Textures encoded in little memory, in several sittings if need be."""

from __future__ import annotations

import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf import Btf
from nacre.errors import FormatError, NacreError, reason
from nacre.io.files import write_encoded
from nacre.io.tensors import Tensors, check_numbers, from_file, to_bytes
from nacre.metrics.texture_errors import Errors, ErrorSums
from nacre.runtime.interrupts import uninterrupted
from nacre.runtime.progress import Progress, silent
from nacre.textures.codecs.codec import TexelCodec, on_all_cores

BLOCK = 1 << 28
"""Bytes of values that are read at a time; two such blocks are in memory."""
_COMPARED = 1 << 23
"""Values of pairs of directions that are decoded to tell the error, about."""
_SAVE_EVERY = 45.0
_KEY = "nacre encoding"
_LIMIT = 1 << 32


@dataclass(frozen=True, eq=False)
class Encoding:
    """What :func:`encode` found.

    Parameters
    ----------
    codes
        Shape (height, width, values).
    errors
        Of what the codes decode to.
    compared
        Pairs of directions a texel that the errors are of, drawn anew for every block of texels.
    """

    codes: npt.NDArray[Any]
    errors: Errors
    compared: int


def encode(
    btf: Btf,
    codec: TexelCodec,
    *,
    half: bool = False,
    texels_per_block: int | None = None,
    state: Path | None = None,
    mark: str = "",
    save_every: float = _SAVE_EVERY,
    progress: Progress = silent,
) -> Encoding:
    """The codes of all texels of a texture, and how well they stand for it.

    While some texels are encoded, the next are read.

    Parameters
    ----------
    btf
        Read by runs of texels; see :func:`nacre.measured.textures.transposed` for one that lies in
        images.
    codec
        For its directions.
    half
        Whether codes are of half precision; errors are of the rounded ones.
    texels_per_block
        That are read at a time; as many as :data:`BLOCK` holds where None.
    state
        File that keeps what is done, for a later call to go on from. It stays, for the caller to
        remove once the codes are saved.
    mark
        What must be the same for that, besides what this function sees.
    save_every
        Seconds between times that it is written: no more is lost when the process is killed, and
        nothing when it is interrupted by Ctrl-C.
    progress
        Called with the texels done.

    Raises
    ------
    FormatError
        If the texture cannot be read, or the state not be written.
    NacreError
        If the codec is for other directions, a code is no number, or the state is of another
        encoding or damaged.
    """
    total = btf.texel_count
    step = texels_per_block or max(1, BLOCK // (12 * btf.pair_count))
    compared = min(btf.pair_count, max(1, _COMPARED // total))
    dtype = np.dtype(np.float16 if half else np.float32)
    run = _Run(np.empty((total, codec.values), dtype), ErrorSums(), 0)
    mark = f"{mark} {btf.width} {btf.height} {btf.pair_count} {step} {codec.values} {dtype}"
    if state is not None and state.exists():
        run.restore(state, mark)
    if run.done < total:
        encoder = on_all_cores(codec, codec.encoder(btf.wi, btf.wo))
    saved = time.monotonic()
    try:
        for block, texels in _read_ahead(btf, run.done, step):
            with np.errstate(over="ignore"):
                codes = encoder(texels).astype(dtype)
            if not np.isfinite(codes).all():
                raise NacreError(f"{btf.name}: some texels have codes that are no numbers")
            chosen = _pairs(btf.pair_count, compared, block.start)
            wi, wo = btf.wi[chosen], btf.wo[chosen]
            decode = on_all_cores(codec, codec.decoder(wi, wo))
            found = decode(codes.astype(np.float32))
            with uninterrupted():
                run.errors.add(texels[:, chosen], found, wo)
                run.codes[block], run.done = codes, block.stop
            if state is not None and time.monotonic() - saved > save_every:
                run.save(state, mark)
                saved = time.monotonic()
            mse = 1e4 * run.errors.result().mse
            progress("encoding", run.done, total, f"MSE x 1e4 {mse:.3g}")
    except KeyboardInterrupt:
        if state is not None:
            with uninterrupted():
                run.save(state, mark)
        raise
    codes = run.codes.reshape(btf.height, btf.width, codec.values)
    return Encoding(codes, run.errors.result(), compared)


class _Run:
    """Codes so far, their errors, and how many texels are done."""

    def __init__(self, codes: npt.NDArray[Any], errors: ErrorSums, done: int) -> None:
        self.codes, self.errors, self.done = codes, errors, done

    def save(self, path: Path, mark: str) -> None:
        """Write it to a file, whole or not at all."""
        tensors: Tensors = {"codes": self.codes[: self.done], "errors": self.errors.sums}
        write_encoded(
            path,
            lambda header: to_bytes(_KEY, header, tensors, _LIMIT),
            {"mark": mark},
            internal=True,
        )

    def restore(self, path: Path, mark: str) -> None:
        """Take up what a file has."""
        advice = "remove it to begin anew"
        try:
            header, tensors = from_file(path, _KEY, _LIMIT, "the state of an encoding")
            if header["mark"] != mark:
                raise NacreError(f"{path}: is of another encoding; {advice}")
            codes = tensors["codes"]
            if codes.dtype != self.codes.dtype or codes.shape[1:] != self.codes.shape[1:]:
                raise ValueError(f"codes are {codes.dtype} {codes.shape}")
            check_numbers(tensors, np.inf)
            self.codes[: len(codes)] = codes
            self.errors, self.done = ErrorSums(tensors["errors"]), len(codes)
        except (FormatError, KeyError, TypeError, ValueError) as error:
            raise NacreError(f"{path}: cannot be read, {advice}: {reason(error)}") from error


def _read_ahead(btf: Btf, start: int, step: int) -> Iterator[tuple[slice, Floats]]:
    """Runs of texels from one on; the next is read while one is used."""
    total = btf.texel_count
    blocks = [slice(first, min(first + step, total)) for first in range(start, total, step)]
    with ThreadPoolExecutor(1, "texels") as reader:
        ahead = [reader.submit(btf.texels, block) for block in blocks[:1]]
        for index, block in enumerate(blocks):
            texels = ahead.pop().result()
            if index + 1 < len(blocks):
                ahead.append(reader.submit(btf.texels, blocks[index + 1]))
            yield block, texels


def _pairs(total: int, count: int, seed: int) -> slice | npt.NDArray[np.intp]:
    """Random pairs of directions in order, or all."""
    if count == total:
        return slice(None)
    return np.sort(np.random.default_rng(seed).choice(total, count, replace=False))
