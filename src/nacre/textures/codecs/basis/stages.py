"""A training in stages that another process can go on with."""

from __future__ import annotations

import glob
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

from nacre.errors import NacreError
from nacre.io.files import write_encoded
from nacre.io.tensors import format_errors, from_file, to_bytes
from nacre.runtime.checkpoint import load_state, save_state
from nacre.runtime.interrupts import uninterrupted
from nacre.textures.codecs.basis.fields import pack_fields, unpack_fields

_KEY = "nacre training stage"
_LIMIT = 1 << 34
_Result = TypeVar("_Result")


class Stages:
    """Keeps results of stages, and how far steps of an optimizer are.

    What a stage gives is written once, when it is done; steps by time.

    Parameters
    ----------
    path
        What names of files start with; None to keep nothing.
    fingerprint
        What must be the same for a training to go on.
    save_every
        Seconds between times that steps are written.
    """

    def __init__(
        self, path: Path | None = None, fingerprint: str = "", save_every: float = 45.0
    ) -> None:
        self._path, self._fingerprint, self._every = path, fingerprint, save_every

    @property
    def files(self) -> list[Path]:
        """All that there are."""
        return self._files("*")

    def has(self, name: str) -> bool:
        """Whether the result of a stage is there."""
        return bool(self._files(name))

    def remove(self, name: str = "*") -> None:
        """Remove all files, or those of stages whose names match a pattern."""
        for path in self._files(name):
            path.unlink(missing_ok=True)

    def _files(self, name: str) -> list[Path]:
        if self._path is None:
            return []
        return sorted(self._path.parent.glob(f"{glob.escape(self._path.name)}.{name}.stage"))

    def result(self, name: str, kind: type[_Result], make: Callable[[], _Result]) -> _Result:
        """What `make` gives, or gave earlier: a dataclass as :func:`pack_fields` takes it.

        Raises
        ------
        NacreError
            If the file is of another training or damaged, or cannot be written.
        """
        if self._path is None:
            return make()
        path = self._file(name)
        if path.exists():
            header, tensors = from_file(path, _KEY, _LIMIT, "a stage of a training")
            with format_errors(path):
                if header["mark"] != self._fingerprint:
                    raise NacreError(
                        f"{path}: is of another training; remove {self._path.name}* to begin anew"
                    )
                return unpack_fields(kind, header["numbers"], tensors)
        found = make()
        numbers, tensors = pack_fields(found)
        header = {"mark": self._fingerprint, "numbers": numbers}
        write_encoded(path, lambda content: to_bytes(_KEY, content, tensors, _LIMIT), header)
        return found

    def steps(
        self,
        name: str,
        count: int,
        tensors: Sequence[Any],
        optimizers: Sequence[Any],
        generator: Any,
    ) -> Iterator[int]:
        """Numbers of steps, from the first that has not been taken; Ctrl-C waits for their ends.

        Parameters
        ----------
        name, count
            Of the stage, and its steps.
        tensors, optimizers, generator
            What a step changes; brought to where an earlier process left them.

        Raises
        ------
        NacreError
            If the file is of another training or damaged, or cannot be written.
        """
        path = None if self._path is None else self._file(f"{name}-steps")
        first = 0

        def restore(state: dict[str, Any]) -> int:
            for mine, saved in zip(tensors, state["tensors"], strict=True):
                mine.data.copy_(saved)
            for optimizer, saved in zip(optimizers, state["optimizers"], strict=True):
                optimizer.load_state_dict(saved)
            generator.set_state(state["generator"])
            return int(state["step"])

        def save(step: int) -> None:
            if path is not None:
                state = {
                    "tensors": [tensor.detach() for tensor in tensors],
                    "optimizers": [optimizer.state_dict() for optimizer in optimizers],
                    "generator": generator.get_state(),
                    "step": step,
                }
                save_state(path, self._fingerprint, state)

        if path is not None and path.exists():
            first = load_state(path, self._fingerprint, restore)
        saved = time.monotonic()
        for step in range(first, count):
            try:
                with uninterrupted():
                    yield step
                    if step + 1 == count or time.monotonic() - saved > self._every:
                        save(step + 1)
                        saved = time.monotonic()
            except KeyboardInterrupt:
                with uninterrupted():
                    save(step + 1)
                raise

    def _file(self, name: str) -> Path:
        assert self._path is not None
        return self._path.with_name(f"{self._path.name}.{name}.stage")
