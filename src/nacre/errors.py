"""Errors that a user can act on."""

from __future__ import annotations

import importlib
import re
from collections.abc import Iterable
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


def did_you_mean(
    name: str, known: Iterable[str], otherwise: str = "", *, similarity: float = 0.6
) -> str:
    """The end of a message about a name that is not known: "; did you mean gold or golden?".

    Up to three names of at least this similarity, from 0 to 1, in any case, the nearest first;
    where there is none, "; " and `otherwise`, such as where to find the names, or nothing if that
    is empty.
    """
    import difflib

    spelled = {each.lower(): each for each in reversed(list(known))}
    near = difflib.get_close_matches(name.lower(), spelled, 3, similarity)
    if near:
        return f"; did you mean {in_words([spelled[each] for each in near], 'or')}?"
    return f"; {otherwise}" if otherwise else ""


def in_words(names: Iterable[str], last: str = "and") -> str:
    """A list as it is said: "a, b and c"."""
    *most, end = names
    return f"{', '.join(most)} {last} {end}" if most else end


_TRACEBACK = "Traceback (most recent call last):"
_NOISE = re.compile(
    r"\[(?:\w+\.(?:cpp|cu|cc|h|py):\d+|[A-Z]\w+)\]\s*(?:\w+\(\): )?"  # Mitsuba, Dr.Jit
    r"|: \d+ : [A-Z_]+ : "  # ONNX Runtime, after its name
    r"|\[enforce fail at [^\]]*\]\s*(?:err == 0\.\s*)?"  # PyTorch
    r"|(?:/[\w.+-]+)+\.(?:cpp|cu|cc|h|hpp):\d+:?\s*(?:\S*::\S*\([^)]*\)\s*)?"  # ONNX Runtime
    r"|\x1b\[[0-9;]*m|[❌\ufe0f]\s*"
)
"""What libraries put into their messages for their own developers: places in sources, marks."""
_HDF5 = re.compile(r"Unable to (?:synchronously )?[\w -]+ \((.*)\)")
_SYSTEM = re.compile(r".*error message = '([^']*)'.*")


def reason(error: Exception, *, whole: bool = False) -> str:
    """What a library says went wrong, on one short line: its first, or all lines if `whole`.

    Places in the library's sources are left out, and so is the traceback of an error within Python
    code that the library called, but for the error's own words.
    """
    text, traceback, inner = str(error).partition(_TRACEBACK)
    if traceback:
        text += inner.strip().rpartition("\n")[2].partition(": ")[2]
    text = _NOISE.sub("", text).strip()
    text = " ".join(text.split()) if whole else text.partition("\n")[0]
    return _SYSTEM.sub(r"\1", _HDF5.sub(r"\1", text))[: 600 if whole else 200]


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
