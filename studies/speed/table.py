"""What the benchmarks share."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence

_VARIABLES = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")


def prevent_oversubscription() -> None:
    """One thread per process in the libraries of the processes started from here on."""
    os.environ.update(dict.fromkeys(_VARIABLES, "1"))


def markdown(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table, numbers to the right."""
    lines = ["| " + " | ".join(columns) + " |", "|---" + "|---:" * (len(columns) - 1) + "|"]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    return "\n".join(lines)
