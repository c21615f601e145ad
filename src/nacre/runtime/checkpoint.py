"""States of trainings in PyTorch, from which another process goes on."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from nacre.errors import NacreError, reason, require
from nacre.io.files import atomic_path

_Result = TypeVar("_Result")


def save_state(path: Path, mark: str, state: dict[str, Any]) -> None:
    """Write a state, whole or not at all.

    Parameters
    ----------
    path
        File to write.
    mark
        What must be the same for a training to go on.
    state
        Tensors, numbers, texts, and lists and dictionaries of such.

    Raises
    ------
    FormatError
        If the path cannot be written.
    """
    # To a file, PyTorch would hide why it cannot be written.
    content = io.BytesIO()
    require("torch", "torch").save({**state, "mark": mark}, content)
    with atomic_path(path, internal=True) as temporary:
        temporary.write_bytes(content.getbuffer())


def load_state(path: Path, mark: str, restore: Callable[[dict[str, Any]], _Result]) -> _Result:
    """What `restore` makes of the state in a file.

    Raises
    ------
    NacreError
        If the state is of another training, or the file is damaged.
    """
    try:
        state = require("torch", "torch").load(path, map_location="cpu", weights_only=True)
        if state["mark"] != mark:
            raise NacreError(f"{path}: is of another training; remove it to begin anew")
        return restore(state)
    except NacreError:
        raise
    except Exception as error:  # a damaged file fails in many ways
        raise NacreError(
            f"{path}: cannot be read, remove it to begin anew: {reason(error)}"
        ) from error
