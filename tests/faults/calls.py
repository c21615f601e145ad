"""The library that makes a call of a command to the system fail, and which calls may."""

from __future__ import annotations

import ctypes
import errno
import functools
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

SOURCE = Path(__file__).with_name("calls.c")
LARGE = 1 << 18
"""Bytes from which an allocation counts."""


@dataclass(frozen=True)
class Kind:
    """Calls that count, and how they fail.

    Parameters
    ----------
    calls
        Number of these calls in `calls.c`.
    error
        What they fail with.
    lasting
        Whether all later calls fail as well, as on a disk that is full.
    words
        One of these is in what the command says.
    """

    calls: int
    error: int
    lasting: bool
    words: tuple[str, ...]


KINDS = {
    "space": Kind(1, errno.ENOSPC, True, ("No space left on device",)),
    "device": Kind(1, errno.EIO, False, ("Input/output error",)),
    "reading": Kind(2, errno.EIO, False, ("Input/output error",)),
    "memory": Kind(3, errno.ENOMEM, False, ("memory", "allocate")),
}
"""A disk that is full from a call on, one that fails once to write or to read, a large allocation
that fails.
"""


class Plan(ctypes.Structure):
    """What is to fail, and what has: see `calls.c`."""

    _fields_ = (
        ("kind", ctypes.c_long),
        ("number", ctypes.c_long),
        ("error", ctypes.c_long),
        ("lasting", ctypes.c_long),
        ("large", ctypes.c_long),
        ("counts", ctypes.c_long * 4),
        ("failed", ctypes.c_long),
        ("call", ctypes.c_char * 32),
        ("folder", ctypes.c_char * 4096),
    )


def plan() -> Plan:
    """That of this process, in which the library must be loaded already."""
    library = ctypes.CDLL(None)
    library.faults_plan.restype = ctypes.POINTER(Plan)
    found: Plan = library.faults_plan().contents
    return found


def compiler() -> str | None:
    """The C compiler that builds the library, if there is one."""
    return shutil.which("gcc")


@functools.cache
def library() -> Path:
    """The library, built."""
    built = Path(tempfile.mkdtemp(prefix="nacre-faults-")) / "calls.so"
    options = ["-O2", "-shared", "-fPIC", "-Wall", "-Wextra", "-Werror"]
    subprocess.run(["gcc", *options, "-o", built, SOURCE, "-ldl"], check=True)
    return built
