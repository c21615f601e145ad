"""Random texels of many files, of which few are in memory at a time."""

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
Picks: TypeAlias = npt.NDArray[np.int64]
"""Pairs of a file and one of its texels, shape (..., 2)."""

_STATISTICS, _HELD_OUT = 16, 256
"""Texels of a file that whitening is found from; held-out texels that are evaluated."""


@dataclass(frozen=True, eq=False)
class Batch:
    """Texels known at the same pairs of directions: reflectance factors, shape (b, n, 3), and the
    index of the directions in :attr:`TexelStream.directions`.
    """

    values: npt.NDArray[np.float32]
    group: int


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


class TexelStream:
    """Batches of random texels of textures.

    Every epoch draws some texels of every file, never one that is held out, and shuffles them into
    batches of texels of the same directions. Batches are read ahead by a thread, as many at once as
    memory allows, so that a file is opened once for all that is needed of it. What an epoch holds
    depends on the seed and its number only. Of several processes each reads its part of every
    batch.

    Parameters
    ----------
    paths
        Files.
    load
        Opens one; called again whenever texels are needed, so that no file stays in memory. See
        :func:`images_once` for folders of images.
    batch
        Texels of a batch, over all processes.
    texels
        Drawn of every file and epoch; fewer where a file has fewer.
    held_out
        Fraction of every file's texels that is never drawn.
    seed
        Of everything random.
    memory
        Bytes of texels that are in memory at once, about.
    rank, size
        Number of this process, and of all.

    Raises
    ------
    FormatError
        As `load` does.
    NacreError
        If there is no file, or the batch cannot be shared out evenly.
    """

    def __init__(
        self,
        paths: Sequence[PathLike],
        load: Load,
        batch: int,
        texels: int,
        *,
        held_out: float = 0.05,
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
        self._memory = memory
        self.directions: list[tuple[Floats, Floats]] = []  # every wi and wo that files have
        self.examples: list[PathLike] = []  # the first file of each
        self.names: list[str] = []  # of the materials
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
        """Batches of an epoch."""
        return int(self._steps.sum())

    def sample(self) -> Iterator[npt.NDArray[np.float32]]:
        """A few training texels of every file, the same for all processes."""
        for index, own in enumerate(self._own):
            yield self._texels_of(index, own[:_STATISTICS, 1])

    def held_out(self) -> list[Batch]:
        """Texels that are never trained on, the same for all processes; none of small files."""
        each = max(1, _HELD_OUT // len(self._paths))
        found: dict[int, list[npt.NDArray[np.float32]]] = {}
        for index, kept in enumerate(self._kept):
            if len(kept):
                values = self._texels_of(index, kept[:each, 1])
                found.setdefault(self._groups[index], []).append(values)
        return [Batch(np.concatenate(parts), group) for group, parts in found.items()]

    def batches(self, start: int, stop: int) -> Generator[Batch, None, None]:
        """The part of this process in the batches from a step to another."""
        plans = self._plans(start, stop)
        with ThreadPoolExecutor(1, "texels") as reader:
            ahead = reader.submit(self._read, next(plans, []))
            while batches := ahead.result():
                ahead = reader.submit(self._read, next(plans, []))
                batches.reverse()
                while batches:
                    yield batches.pop()

    def _plans(self, start: int, stop: int) -> Iterator[list[Picks]]:
        """What is read at once: the texels of some batches in a row, of one epoch."""
        plan: list[Picks] = []
        used = 0
        for step in range(start, stop):
            epoch, index = divmod(step, self.epoch_steps)
            if step == start or index == 0:
                order = self._epoch(epoch)
            picks = order[index][self._part]
            wi, _ = self.directions[self._groups[picks[0, 0]]]
            needed = 12 * len(picks) * len(wi)
            # Two of them are in memory: one is used while the next is read.
            if plan and (index == 0 or used + needed > self._memory // 2):
                yield plan
                plan, used = [], 0
            plan.append(picks)
            used += needed
        if plan:
            yield plan

    def _epoch(self, epoch: int) -> list[Picks]:
        """The texels of all batches of an epoch."""
        random = np.random.default_rng((self._seed, 3, epoch))
        batches: list[Picks] = []
        for group, steps in enumerate(self._steps):
            owned = zip(self._own, self._groups, strict=True)
            drawn = [random.permutation(own)[: self._texels] for own, of in owned if of == group]
            picks = random.permutation(np.concatenate(drawn))
            batches += list(np.resize(picks, (steps, self._batch, 2)))
        return [batches[index] for index in random.permutation(len(batches))]

    def _read(self, plan: list[Picks]) -> list[Batch]:
        """The batches of a plan, every file opened once."""
        groups = [self._groups[picks[0, 0]] for picks in plan]
        found = [
            Batch(np.empty((len(picks), len(self.directions[group][0]), 3), np.float32), group)
            for picks, group in zip(plan, groups, strict=True)
        ]
        if plan:
            every = np.concatenate(plan)
            places = [(batch, row) for batch in found for row in range(len(batch.values))]
            for file in np.unique(every[:, 0]):
                chosen = np.flatnonzero(every[:, 0] == file)
                values = self._texels_of(int(file), every[chosen, 1])
                for place, row in zip(chosen, values, strict=True):
                    batch, index = places[place]
                    batch.values[index] = row
        return found

    def _texels_of(self, index: int, chosen: npt.NDArray[np.int64]) -> npt.NDArray[np.float32]:
        """Values of some texels of a file."""
        path = self._paths[index]
        values = np.asarray(self._load(path).texels(chosen), np.float32)
        if not np.isfinite(values).all():
            raise FormatError(f"{path}: holds values that are not finite; mend or leave it out")
        return values
