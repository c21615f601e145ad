"""Every file of `field/` among the real data: whether it is read, and what its values are checked
against."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Real:
    """One real file.

    Parameters
    ----------
    file
        Its place in the folder of real files.
    checked
        What the values are compared with, and `tests/...py` that does it; empty where none are
        read.
    refused
        Words of the message that refuses it; empty where it is read.
    options
        What the reader has to be told, as keywords of :func:`nacre.load`.
    """

    file: str
    checked: str = ""
    refused: str = ""
    options: Mapping[str, Any] = field(default_factory=dict)


REAL: tuple[Real, ...] = ()
