"""Encoding of blocks of texels as work for a cluster."""

from __future__ import annotations

import hashlib
import pickle
import threading
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, TypeAlias

import numpy.typing as npt

from nacre.btf import Btf
from nacre.errors import FormatError, NacreError
from nacre.runtime.code_fingerprint import code_fingerprint, place_of
from nacre.runtime.progress import Progress, silent
from nacre.workflows.cluster import Cluster
from nacre.workflows.encoded_blocks import BlockEncoder, EncodedBlock
from nacre.workflows.material import explain
from nacre.workflows.openers import pickled
from nacre.workflows.submission import EndedError
from nacre.workflows.watcher import Watcher
from nacre.workflows.worker import Here, Unread, Work

Results: TypeAlias = Generator[tuple[slice, EncodedBlock], None, None]
"""Blocks of texels with their results, in any order."""


@dataclass(frozen=True, eq=False)
class Block:
    """A block of texels to encode; `texels` returns their values."""

    block: slice
    texels: Callable[[], npt.NDArray[Any]]
    progress: Progress = silent


@dataclass(frozen=True)
class Failure:
    """Why a block cannot be encoded by any worker."""

    error: str


class Blocks(Work[Block, EncodedBlock | Failure]):
    """See :class:`nacre.workflows.worker.Work`; an item is the first and the end of some texels.

    Parameters
    ----------
    encoder
        Encodes a block.
    opener
        Opens the texture in a worker, and raises an OSError or FormatError if it is not there; None
        if values must be sent.
    """

    verb = "encode"
    kept = "finished blocks are kept, add --resume to continue"

    def __init__(self, encoder: BlockEncoder, opener: Callable[[], Btf] | None) -> None:
        self._codec, self._name, self._sent = type(encoder.codec), encoder.name, opener is None
        self._parts = pickle.dumps((encoder, opener), pickle.HIGHEST_PROTOCOL)
        self._digest = hashlib.sha256(self._parts).hexdigest()

    @property
    def digest(self) -> str:
        return self._digest

    @property
    def nbytes(self) -> int:
        return len(self._parts)

    def code(self) -> str | None:
        try:
            return code_fingerprint(*sorted({place_of(BlockEncoder), place_of(self._codec)}))
        except (ValueError, OSError, SyntaxError):  # the source is being edited
            return None

    def check(self) -> None:
        _unpacked(self._parts)

    def pack(self, job: Block, *, send: bool) -> tuple[Any, npt.NDArray[Any] | None]:
        content = job.texels() if send or self._sent else None
        return (job.block.start, job.block.stop), content

    def do(
        self, item: Any, content: npt.NDArray[Any] | None, here: Here
    ) -> EncodedBlock | Failure | Unread:
        block = slice(*item)
        try:
            parts = _unpacked(self._parts)
            if content is None:
                try:
                    btf = parts.texture
                except (FormatError, OSError) as error:
                    return Unread(f"on worker {here.address}: {error}")
                with _LOCK:  # files are read by one thread at a time
                    content = parts.encoder.read(btf, block)
            return parts.encoder(block.start, content)
        except NacreError as error:
            return Failure(str(error))
        except Exception as error:
            return Failure(f"{self._name}: on worker {here.address}: {explain(error, Path())}")

    def failed(self, job: Block, error: Exception) -> EncodedBlock:
        if isinstance(error, EndedError):
            where = f"texels {job.block.start} to {job.block.stop - 1}"
            raise EndedError(f"{self._name}: {where}: {error}; {self.kept}")
        raise error


class _Parts:
    """What a worker has for all blocks of a texture."""

    def __init__(self, encoder: BlockEncoder, opener: Callable[[], Btf]) -> None:
        self.encoder, self._opener = encoder, opener
        self._texture: Btf | None = None

    @property
    def texture(self) -> Btf:
        with _LOCK:
            self._texture = self._texture or self._opener()
            return self._texture


_LOCK = threading.Lock()  # makes threads that ask for the same wait for one answer


def _unpacked(parts: bytes) -> _Parts:
    with _LOCK:
        return _unpacked_last(parts)


@lru_cache(maxsize=1)
def _unpacked_last(parts: bytes) -> _Parts:
    return _Parts(*pickle.loads(parts))


@dataclass(frozen=True)
class BlockWorkers:
    """Where blocks are encoded, if not in this process.

    Parameters
    ----------
    cluster
        Its workers do the work.
    opener
        Opens the texture in a worker, see :mod:`nacre.workflows.openers`; if None, a texture that
        takes few bytes is sent itself, and of others the values.
    watcher
        Told about the dashboard.
    """

    cluster: Cluster
    opener: Callable[[], Btf] | None = None
    watcher: Watcher = field(default_factory=Watcher)

    def encoded(self, btf: Btf, encoder: BlockEncoder, missing: Sequence[slice]) -> Results:
        """Results of the blocks; a NacreError says that one cannot be encoded.

        An :class:`nacre.workflows.submission.EndedError` says that the cluster cannot go on.
        """
        if not missing:
            return
        opener = self.opener or pickled(btf)
        if opener is None and self.cluster.data == "path":
            raise NacreError(
                f"{btf.name}: workers cannot read this kind of texture by its path; "
                "leave out --data path"
            )
        work = Blocks(encoder, opener)
        jobs = (Block(block, partial(encoder.read, btf, block)) for block in missing)
        with self.cluster.connect(work, self.watcher) as stream:
            for job, found in stream(jobs):
                if isinstance(found, Failure):
                    btf.texels(job.block)  # says so if it is values of a file that are not finite
                    raise NacreError(found.error)
                yield job.block, found
