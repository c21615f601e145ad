"""Errors that a user can act on."""

from __future__ import annotations

import importlib
from types import ModuleType

DISTRIBUTION = "nacre-materials"
"""Name on the package index, where `nacre` is someone else's package."""


class NacreError(Exception):
    """Something a user can fix; the message is one line that says how.

    Characters that cannot be printed, of which a damaged file may have any, are escaped.
    """

    def __init__(self, message: str) -> None:
        super().__init__(printable(message))


CUT_SHORT = "the file is cut short or damaged; copy or download it again"
"""What to say of a file that ends too early."""


def printable(text: str) -> str:
    """One line without control characters, whatever a file or its name holds."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def reason(error: Exception) -> str:
    """What a library says went wrong, on one short line."""
    return str(error).partition("\n")[0][:200]


_SHORTAGES = (
    "failed to map segment",
    "could not find/load shared object",  # llvmlite's words for it
    "cannot allocate memory",
    "out of memory",
    "bad_alloc",
)


def is_shortage(error: BaseException) -> bool:
    """Whether an error says that memory, or the address space that `ulimit -v` leaves, ran out."""
    text = str(error).lower()
    return isinstance(error, MemoryError) or any(words in text for words in _SHORTAGES)


class FormatError(NacreError, ValueError):
    """A file that cannot be read or written as what it claims to be.

    The message names the file, the offending field and, where there is one, the fix.
    """


class MissingExtraError(NacreError, ImportError):
    """An optional dependency that is not installed."""


def require(module: str, extra: str) -> ModuleType:
    """Import an optional dependency.

    Raises MissingExtraError, naming the extra of this package that brings `module`, or saying why
    it does not load.
    """
    package = module.partition(".")[0]
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise MissingExtraError(
            f"this needs {package}, which is not installed: pip install '{DISTRIBUTION}[{extra}]'"
        ) from error
    except Exception as error:  # a library of the system that is missing shows in many ways
        cause = error.__context__ if isinstance(error.__context__, Exception) else error
        message = f"{package} is installed but does not load: {reason(cause)}"
        if is_shortage(cause):
            message = f"not enough memory to load {package}: free some, or raise ulimit -v"
        raise MissingExtraError(message) from error
