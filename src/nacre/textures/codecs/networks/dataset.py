"""Random texels from many files, of which few are in memory at a time."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf import Btf
from nacre.errors import FormatError, NacreError
from nacre.io.files import PathLike
from nacre.measured.textures.transposition import transposed

Load: TypeAlias = Callable[[PathLike], Btf]
Picks: TypeAlias = npt.NDArray[np.int64]  # pairs of a file and one of its texels, shape (..., 2)
Entries: TypeAlias = npt.NDArray[np.int64] | None
"""Some pairs of directions, in their order; None for all."""

_STATISTICS, _HELD_OUT = 16, 256
"""Texels of a file that whitening is found from; held-out texels that are evaluated."""


@dataclass(frozen=True, eq=False)
class Batch:
    """Texels at the same pairs of directions: reflectance factors, shape (b, n, 3); the index of
    their directions in :attr:`TexelStream.directions`; and which of those directions they are at.
    """

    values: npt.NDArray[np.float32]
    group: int
    entries: Entries = None


@contextmanager
def images_once(load: Load) -> Iterator[Load]:
    """The same as `load`, but a texture that lies in images is opened and read once.

    While the block lasts it lies in a temporary file of halves, see
    :func:`nacre.measured.textures.transposition.transposed`.
    """
    with ExitStack() as stack:
        kept: dict[PathLike, Btf] = {}

        def opened(path: PathLike) -> Btf:
            if path in kept:
                return kept[path]
            texture = load(path)
            if texture.by_image:
                texture = kept[path] = stack.enter_context(transposed(texture))
            return texture

        yield opened


@dataclass(frozen=True, eq=False)
class _Plan:
    """What is read for a batch: texels of files, all of one group, at some directions."""

    picks: Picks
    group: int
    entries: Entries
    pairs: int  # how many are read


class TexelStream:
    """Batches of random texels of textures.

    Every epoch draws `texels` texels from every file, or all that a smaller file has, never one of
    the fraction `held_out`, and shuffles them into batches of texels with the same directions. A
    thread reads batches ahead, as many at once as `memory` bytes allow, about, so that a file is
    opened once for all that is needed of it. What an epoch holds depends only on the seed and its
    number. With several processes (`rank`, `size`), each reads its part of every batch; `batch` is
    the number of texels over all of them.

    `load` opens a file, whenever its texels are needed, so that no file stays in memory; see
    :func:`images_once` for folders of images. `entries` says which pairs of directions a batch
    needs, given the step and the number of pairs: no others are read; all where None.

    Raises what `load` does, and a NacreError if there is no file, or the batch cannot be shared out
    evenly.
    """

    def __init__(
        self,
        paths: Sequence[PathLike],
        load: Load,
        batch: int,
        texels: int,
        *,
        held_out: float = 0.05,
        entries: Callable[[int, int], Entries] | None = None,
        seed: int = 0,
        memory: int = 1 << 31,
        rank: int = 0,
        size: int = 1,
    ) -> None:
        if not paths:
            raise NacreError("there is no file to train on")
        if batch % size:
            raise NacreError(f"a batch of {batch} texels cannot be shared by {size} processes")
        self._paths, self._load, self._batch, self._seed = paths, load, batch, seed
        self._part = slice(rank * batch // size, (rank + 1) * batch // size)
        self._memory, self._entries = memory, entries
        self.directions: list[tuple[Floats, Floats]] = []  # every wi and wo in files
        self.examples: list[PathLike] = []  # the first file of each
        self.names: list[str] = []  # the materials'
        self._groups: list[int] = []
        self._own: list[Picks] = []
        self._kept: list[Picks] = []
        known: dict[bytes, int] = {}
        for index, path in enumerate(paths):
            texture = load(path)
            key = texture.wi.tobytes() + texture.wo.tobytes()
            if key not in known:
                known[key] = len(known)
                self.directions.append((np.array(texture.wi), np.array(texture.wo)))
                self.examples.append(path)
            self._groups.append(known[key])
            self.names.append(texture.name or Path(path).name)
            order = np.random.default_rng((seed, 2, index)).permutation(texture.texel_count)
            picks = np.stack([np.full_like(order, index), order], axis=1)
            kept = int(held_out * len(picks))
            self._kept.append(picks[:kept])
            self._own.append(picks[kept:])
        counts = np.zeros(len(known), int)
        for group, own in zip(self._groups, self._own, strict=True):
            counts[group] += min(len(own), texels)
        self._texels = texels
        self._steps = np.maximum(counts // batch, 1)

    @property
    def epoch_steps(self) -> int:
        return int(self._steps.sum())

    def sample(self) -> Iterator[npt.NDArray[np.float32]]:
        """A few training texels of every file, the same for all processes."""
        for index, own in enumerate(self._own):
            yield self._texels_of(index, own[:_STATISTICS, 1])

    def held_out(self) -> list[Batch]:
        """Texels that are never trained on, the same for all processes; small files have none."""
        each = max(1, _HELD_OUT // len(self._paths))
        found: dict[int, list[npt.NDArray[np.float32]]] = {}
        for index, kept in enumerate(self._kept):
            if len(kept):
                values = self._texels_of(index, kept[:each, 1])
                found.setdefault(self._groups[index], []).append(values)
        return [Batch(np.concatenate(parts), group) for group, parts in found.items()]

    def batches(self, start: int, stop: int) -> Generator[Batch, None, None]:
        """The batches from one step to another, as far as they belong to this process."""
        plans = self._plans(start, stop)
        with ThreadPoolExecutor(1, "texels") as reader:
            ahead = reader.submit(self._read, next(plans, []))
            while batches := ahead.result():
                ahead = reader.submit(self._read, next(plans, []))
                batches.reverse()
                while batches:
                    yield batches.pop()

    def _plans(self, start: int, stop: int) -> Iterator[list[_Plan]]:
        """What is read at once: the texels of some batches in a row, in one epoch."""
        plan: list[_Plan] = []
        used = 0
        for step in range(start, stop):
            epoch, index = divmod(step, self.epoch_steps)
            if step == start or index == 0:
                order = self._epoch(epoch)
            picks = order[index][self._part]
            group = self._groups[picks[0, 0]]
            pairs = len(self.directions[group][0])
            entries = None if self._entries is None else self._entries(step, pairs)
            pairs = pairs if entries is None else len(entries)
            needed = 12 * len(picks) * pairs
            # Two of them are in memory: one is used while the next is read.
            if plan and (index == 0 or used + needed > self._memory // 2):
                yield plan
                plan, used = [], 0
            plan.append(_Plan(picks, group, entries, pairs))
            used += needed
        if plan:
            yield plan

    def _epoch(self, epoch: int) -> list[Picks]:
        random = np.random.default_rng((self._seed, 3, epoch))
        batches: list[Picks] = []
        for group, steps in enumerate(self._steps):
            owned = zip(self._own, self._groups, strict=True)
            drawn = [random.permutation(own)[: self._texels] for own, of in owned if of == group]
            picks = random.permutation(np.concatenate(drawn))
            batches += list(np.resize(picks, (steps, self._batch, 2)))
        return [batches[index] for index in random.permutation(len(batches))]

    def _read(self, plan: list[_Plan]) -> list[Batch]:
        shapes = ((len(part.picks), part.pairs, 3) for part in plan)
        values = (np.empty(shape, np.float32) for shape in shapes)
        found = [Batch(v, p.group, p.entries) for v, p in zip(values, plan, strict=True)]
        for file in np.unique([part.picks[:, 0] for part in plan]) if plan else ():
            texture = self._load(self._paths[file])
            for part, batch in zip(plan, found, strict=True):
                rows = np.flatnonzero(part.picks[:, 0] == file)
                if len(rows):
                    batch.values[rows] = self._values(
                        texture, int(file), part.picks[rows, 1], part.entries
                    )
        return found

    def _texels_of(self, index: int, chosen: npt.NDArray[np.int64]) -> npt.NDArray[np.float32]:
        return self._values(self._load(self._paths[index]), index, chosen, None)

    def _values(
        self, texture: Btf, index: int, chosen: npt.NDArray[np.int64], entries: Entries
    ) -> npt.NDArray[np.float32]:
        found = texture.texels(chosen) if entries is None else texture.texels_at(chosen, entries)
        values = np.asarray(found, np.float32)
        if not np.isfinite(values).all():
            where = self._paths[index]
            raise FormatError(f"{where}: holds values that are not finite; mend or leave it out")
        return values
