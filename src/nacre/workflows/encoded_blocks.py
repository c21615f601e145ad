"""Codes of a texture, block of texels by block, in any order, and what is kept of them."""

from __future__ import annotations

import struct
import time
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Doubles, Floats
from nacre.btf import Btf
from nacre.errors import NacreError
from nacre.io.tensors import check_numbers
from nacre.metrics.texture_errors import ErrorSums
from nacre.runtime.parallel import one_blas_thread
from nacre.runtime.records import Records
from nacre.runtime.store import SAVE_EVERY, readable
from nacre.textures.codecs.codec import Coder, TexelCodec, on_all_cores

_SUMS = np.dtype("<f8")
_INDEX = struct.Struct("<Q")
_LARGEST = 1e100  # number in a state, so that sums stay finite


@dataclass(frozen=True, eq=False)
class EncodedBlock:
    """Codes of a run of texels, shape (b, code_dim), and sums of their errors."""

    codes: npt.NDArray[Any]
    sums: Doubles


@dataclass(frozen=True, eq=False)
class BlockEncoder:
    """Encodes runs of texels, each by itself: a block's result depends on nothing but its texels.

    Parameters
    ----------
    codec, wi, wo
        The codec, and the pairs of directions of the texels, shape (n, 3).
    dtype
        Type of the codes.
    compared
        Pairs of directions per texel whose errors are counted, drawn anew for every block.
    name
        Of the texture, for messages.
    """

    codec: TexelCodec
    wi: Floats
    wo: Floats
    dtype: np.dtype[Any]
    compared: int
    name: str

    def __getstate__(self) -> dict[str, Any]:
        """What is pickled: not what is made from it."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @cached_property
    def _coder(self) -> Coder:
        """What is done once for all blocks; raises as :meth:`TexelCodec.encoder`."""
        with one_blas_thread():  # the number of threads would decide the last bits
            return self.codec.coder(self.wi, self.wo)

    def read(self, btf: Btf, block: slice) -> npt.NDArray[Any]:
        """Texels of a texture as they can be encoded."""
        return btf.kept_texels(block) if self.codec.takes_half else btf.texels(block)

    def __call__(self, start: int, texels: npt.NDArray[Any]) -> EncodedBlock:
        """The result for texels from number `start` on, shape (b, n, 3).

        Raises a NacreError if a code is not finite.
        """
        coder = self._coder
        sums = ErrorSums()
        with one_blas_thread():
            with np.errstate(over="ignore"):
                encode = on_all_cores(self.codec, coder.encode, self.codec.encoded_together)
                codes = encode(texels).astype(self.dtype)
            if not np.isfinite(codes).all():
                raise NacreError(f"{self.name}: some texels have codes that are not finite")
            chosen = _pairs(len(self.wi), self.compared, start)
            decode = on_all_cores(self.codec, coder.decoder(chosen))
            sums.add(texels, decode(codes.astype(np.float32)), self.wo[chosen], chosen)
        return EncodedBlock(codes, sums.sums)


class EncodedBlocks:
    """The blocks of a texture that are done, in memory and, up to the last save, in a file.

    A NacreError says that the file cannot be read, or belongs to another encoding.

    Parameters
    ----------
    total, step
        Texels of the texture, and of a block; the last block may have fewer.
    code_dim, dtype
        Values of a code, and their type.
    state, fingerprint
        The file, and what must be the same to resume; nothing is kept without a file.
    """

    def __init__(
        self,
        total: int,
        step: int,
        code_dim: int,
        dtype: np.dtype[Any],
        state: Path | None,
        fingerprint: str,
    ) -> None:
        self._slices = [slice(k, min(k + step, total)) for k in range(0, total, step)]
        self.codes = np.zeros((total, code_dim), dtype)
        """Of all texels, shape (total, code_dim); zeros where they are missing."""
        self._stored = self.codes.dtype.newbyteorder("<")
        self._sums = np.zeros((len(self._slices), *ErrorSums().sums.shape))
        self._has = np.zeros(len(self._slices), bool)
        self.done = 0
        """Number of texels that are encoded."""
        self.so_far = ErrorSums()
        """Errors of the blocks that are done, added in the order they came."""
        self._unsaved: list[int] = []
        self._saved = time.monotonic()
        self._step = step
        size = _INDEX.size + self._sums[0].nbytes + self.codes[:1].nbytes * min(step, total)
        self._records = Records(state, fingerprint, size)
        for record in self._records.load():
            self._restore(record)

    @property
    def missing(self) -> list[slice]:
        """Runs of texels that are yet to be encoded, in order."""
        return [block for block, has in zip(self._slices, self._has, strict=True) if not has]

    @property
    def errors(self) -> ErrorSums:
        """Errors of all blocks, added in the order of the blocks, which decides the last bits."""
        errors = ErrorSums()
        for sums in self._sums:
            errors.sums += sums
        return errors

    def add(self, block: slice, found: EncodedBlock) -> None:
        """Take the result for one of the blocks that are missing."""
        self._take(block.start // self._step, found)
        self._unsaved.append(block.start // self._step)

    def save(self) -> None:
        """Add what is new to the file."""
        self._records.add(map(self._record, self._unsaved))
        self._unsaved, self._saved = [], time.monotonic()

    def save_if_due(self) -> None:
        """Save if the time between saves has passed since the last one, or since the start."""
        if time.monotonic() - self._saved > SAVE_EVERY:
            self.save()

    def _take(self, index: int, found: EncodedBlock) -> None:
        if self._has[index]:  # two processes may have added it to the file
            return
        self.codes[self._slices[index]] = found.codes
        self._sums[index], self._has[index] = found.sums, True
        self.so_far.sums += found.sums
        self.done += len(found.codes)

    def _record(self, index: int) -> bytes:
        codes = self.codes[self._slices[index]].astype(self._stored).tobytes()
        record: bytes = _INDEX.pack(index) + self._sums[index].astype(_SUMS).tobytes() + codes
        return record.ljust(self._records.size, b"\0")

    def _restore(self, record: bytes) -> None:
        assert self._records.path is not None
        with readable(self._records.path):
            (index,) = _INDEX.unpack_from(record)
            if index >= len(self._slices):
                raise ValueError(f"block {index} of {len(self._slices)}")
            block, shape = self._slices[index], self._sums[index].shape
            start = _INDEX.size + self._sums[index].nbytes
            sums = np.frombuffer(record[_INDEX.size : start], _SUMS).reshape(shape)
            count = (block.stop - block.start) * self.codes.shape[1]
            codes = np.frombuffer(record, self._stored, count, start)
            check_numbers({"codes": codes, "errors": sums}, _LARGEST)
            self._take(index, EncodedBlock(codes.reshape(-1, self.codes.shape[1]), sums))


def _pairs(total: int, count: int, seed: int) -> slice | npt.NDArray[np.intp]:
    """Random pairs of directions in order, or all."""
    if count == total:
        return slice(None)
    return np.sort(np.random.default_rng(seed).choice(total, count, replace=False))
