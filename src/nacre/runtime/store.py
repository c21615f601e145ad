"""States and results of long work in files, from which another process can continue.

A state is a tree of dictionaries, lists, numbers, texts and arrays (of NumPy or PyTorch). It is
written as safetensors: loading it runs no code.
"""

from __future__ import annotations

import glob
import math
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from nacre.errors import FormatError, NacreError, reason, require
from nacre.io.files import remove_file, write_encoded
from nacre.io.tensors import Tensors, from_file, to_bytes
from nacre.runtime.interrupts import uninterrupted

SAVE_EVERY = 45.0
"""Seconds between saves of long work: a killed process loses no more."""

_KEY = "nacre state"
_LIMIT = 1 << 34
_ARRAY, _TUPLE, _ITEMS, _FLOAT = "$array", "$tuple", "$items", "$float"


class Store:
    """Named states beside a path, all of one piece of work.

    The state without a name is kept at the path, one with a name in `PATH.NAME.state`; without a
    path, nothing is kept. Files with another `fingerprint` are refused: it stands for what must be
    the same for the work to continue.
    """

    def __init__(self, path: Path | None, fingerprint: str = "") -> None:
        self.path, self.fingerprint = path, fingerprint
        self._saved = time.monotonic()

    def __contains__(self, name: str) -> bool:
        return self.path is not None and self.file(name).exists()

    def file(self, name: str = "") -> Path:
        """Where the state of a name is kept."""
        assert self.path is not None
        return self.path.with_name(f"{self.path.name}.{name}.state") if name else self.path

    def files(self, names: str = "*") -> list[Path]:
        """All files there are, or those of states whose names match a pattern."""
        if self.path is None:
            return []
        named = self.path.parent.glob(f"{glob.escape(self.path.name)}.{names}.state")
        return [*([self.path] if names == "*" and self.path.exists() else []), *sorted(named)]

    def load(self, name: str = "") -> Any | None:
        """The state of a name; None if there is none.

        A :class:`NacreError` says what to remove if it belongs to other work, or is damaged.
        """
        if name not in self:
            return None
        path = self.file(name)
        with self.readable(name):
            header, tensors = from_file(path, _KEY, _LIMIT, "a state that nacre keeps")
            if header["fingerprint"] != self.fingerprint:
                raise NacreError(f"{path}: belongs to another run; remove it to start over")
            return _unpacked(header["state"], tensors)

    def save(self, state: Any, name: str = "") -> None:
        """Keep a state, whole or not at all, in place of the one of that name."""
        self._saved = time.monotonic()
        if self.path is None:
            return
        tensors: Tensors = {}
        header = {"fingerprint": self.fingerprint, "state": _packed(state, tensors)}
        encode = partial(to_bytes, _KEY, tensors=tensors, limit=_LIMIT)
        write_encoded(self.file(name), encode, header, internal=True)

    def steps(
        self,
        count: int,
        state: Callable[[], Any],
        restore: Callable[[Any], None],
        name: str = "",
        seconds: float = SAVE_EVERY,
    ) -> Iterator[int]:
        """Numbers of steps, from the first that has not been taken; Ctrl-C waits for a step to end.

        The state is saved every `seconds`, after the last of `count` steps, and when the work is
        interrupted. `state` returns what the steps change, and `restore` brings it to where an
        earlier process left it.
        """
        first = 0
        if (kept := self.load(name)) is not None:
            with self.readable(name):
                first = int(kept["step"])
                if not 0 <= first <= count:
                    raise ValueError(f"step {first} of {count}")
                restore(kept["state"])
        for step in range(first, count):
            try:
                with uninterrupted():
                    yield step
                    if step + 1 == count or self.due(seconds):
                        self.save({"step": step + 1, "state": state()}, name)
            except KeyboardInterrupt:
                with uninterrupted():
                    self.save({"step": step + 1, "state": state()}, name)
                raise

    def readable(self, name: str = "") -> AbstractContextManager[None]:
        """A block that restores the state of a name; see :func:`readable`."""
        return readable(self.file(name))

    def due(self, seconds: float) -> bool:
        """Whether so much time has passed since a state was saved, or since the start."""
        return time.monotonic() - self._saved > seconds

    def check_wanted(self, resume: bool) -> None:
        """Refuse, by a :class:`NacreError`, to begin work anew whose states are there."""
        if not resume and (files := self.files()):
            others = "the file" if len(files) == 1 else f"{self.path}*"
            raise NacreError(
                f"{files[0]}: work was stopped here; add --resume to continue the same command, or "
                f"remove {others}"
            )

    def remove(self, names: str = "*") -> None:
        for path in self.files(names):
            remove_file(path)


@contextmanager
def readable(path: Path) -> Iterator[None]:
    """A block that restores a state from a file, in which damage to it shows in many ways.

    A :class:`NacreError` names the file, and says that removing it begins the work anew.
    """
    try:
        yield
    except Exception as error:  # a library may be restoring the state
        if isinstance(error, NacreError) and not isinstance(error, FormatError):
            raise
        problem = f"cannot be read, remove it to start over: {reason(error)}"
        raise NacreError(f"{path}: {problem}") from error


def restore_optimizer(optimizer: Any, saved: Mapping[str, Any]) -> None:
    """Restore the counts and moments of a PyTorch optimizer; its settings stay as they are.

    Raises what PyTorch raises, or ValueError, if they belong to other parameters.
    """
    groups = optimizer.state_dict()["param_groups"]
    optimizer.load_state_dict({"state": saved["state"], "param_groups": groups})
    for parameter, values in optimizer.state.items():
        for value in values.values():
            if getattr(value, "ndim", 0) and value.shape != parameter.shape:
                raise ValueError("the state of the optimizer is of other parameters")


def _packed(value: Any, tensors: Tensors) -> Any:
    """A tree as JSON has it; arrays go to `tensors`, and their places name them."""
    if isinstance(value, float) and not math.isfinite(value):
        return {_FLOAT: str(value)}
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Mapping):
        items = [[_packed(k, tensors), _packed(v, tensors)] for k, v in value.items()]
        if all(isinstance(k, str) and not k.startswith("$") for k, _ in items):
            return dict(items)
        return {_ITEMS: items}
    if isinstance(value, tuple):
        return {_TUPLE: [_packed(v, tensors) for v in value]}
    if isinstance(value, list):
        return [_packed(v, tensors) for v in value]
    name = str(len(tensors))
    if isinstance(value, np.ndarray):
        tensors[name] = np.ascontiguousarray(value).reshape(value.shape)
        return {_ARRAY: name}
    if type(value).__module__.partition(".")[0] == "torch" and hasattr(value, "detach"):
        array = value.detach().cpu().contiguous()
        kind = str(array.dtype).removeprefix("torch.")
        if kind == "bfloat16":  # NumPy has no such numbers
            array = array.view(require("torch", "latent").int16)
        tensors[name] = array.numpy().copy()
        return {_ARRAY: name, "torch": kind}
    raise TypeError(f"a state cannot hold a {type(value).__name__}")


def _unpacked(value: Any, tensors: Tensors) -> Any:
    if isinstance(value, list):
        return [_unpacked(v, tensors) for v in value]
    if not isinstance(value, dict):
        return value
    if _ARRAY in value:
        array = tensors[value[_ARRAY]]
        if "torch" not in value:
            return array
        torch = require("torch", "latent")
        tensor = torch.from_numpy(array.copy())
        return tensor.view(torch.bfloat16) if value["torch"] == "bfloat16" else tensor
    if _FLOAT in value:
        return float(value[_FLOAT])
    if _TUPLE in value:
        return tuple(_unpacked(v, tensors) for v in value[_TUPLE])
    if _ITEMS in value:
        return {_unpacked(k, tensors): _unpacked(v, tensors) for k, v in value[_ITEMS]}
    return {k: _unpacked(v, tensors) for k, v in value.items()}
