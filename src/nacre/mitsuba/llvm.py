"""Finds a libLLVM that Dr.Jit can use, before Dr.Jit looks for one itself.

Dr.Jit takes the first libLLVM it finds, and releases 15 and 16 end the process at the first
`dr.maximum`. This file needs the standard library only, so a setup script can run it by path before
anything is installed: it prints the library, or what to install.
"""

from __future__ import annotations

import ctypes
import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path

MINIMUM = 17
"""Oldest major release of LLVM that works."""

VARIABLE = "DRJIT_LIBLLVM_PATH"
"""Environment variable from which Dr.Jit reads the path of libLLVM."""

_LINUX = (
    "usr/lib/*-linux-*/libLLVM*.so*",  # Debian, Ubuntu
    "usr/lib/llvm-*/lib/libLLVM*.so*",
    "usr/lib64/libLLVM*.so*",  # Fedora
    "usr/lib64/llvm*/lib/libLLVM*.so*",
    "usr/lib/libLLVM*.so*",  # Arch
    "usr/lib/llvm*/lib/libLLVM*.so*",  # Alpine
    "usr/lib/llvm/*/lib*/libLLVM*.so*",  # Gentoo
    "usr/local/lib/libLLVM*.so*",
)
_MACOS = (
    "opt/homebrew/opt/llvm*/lib/libLLVM*.dylib",  # Apple silicon
    "usr/local/opt/llvm*/lib/libLLVM*.dylib",  # Intel
)
_WINDOWS = ("LLVM/bin/LLVM-C.dll",)

_NAME = re.compile(r"libLLVM(-\d+(\.\d+)*)?(\.so|\.\d+|\.dylib)*|LLVM-C\.dll")
_VERSIONS = (
    re.compile(r"libLLVM-(\d+)(?:\.(\d+))?[^/\\]*$"),
    re.compile(r"libLLVM\.so\.(\d+)(?:\.(\d+))?[^/\\]*$"),
    re.compile(r"llvm(?:@\d+)?[/\\](\d+)(?:\.(\d+))?"),  # Homebrew's Cellar/llvm/19.1.7
    re.compile(r"llvm-?(\d+)()[/\\]lib"),  # /usr/lib/llvm-19/lib
)


def version(library: Path) -> tuple[int, int]:
    """Major and minor release of a libLLVM, from its resolved path; (0, 0) if that does not tell.

    On Windows, where the name is always the same, Clang's resource folder beside it tells.
    """
    path = library.resolve()
    if path.suffix == ".dll":
        folders = (path.parent.parent / "lib" / "clang").glob("[0-9]*")
        return max((_numbers(folder.name) for folder in folders), default=(0, 0))
    for pattern in _VERSIONS:
        if found := pattern.search(str(path)):
            return _numbers(".".join(part for part in found.groups() if part))
    return 0, 0


def _numbers(text: str) -> tuple[int, int]:
    major, minor, *_ = [*(int(part) for part in text.split(".") if part.isdigit()), 0, 0]
    return major, minor


def candidates(platform: str, roots: tuple[Path, ...]) -> Iterator[Path]:
    """Every libLLVM in a platform's usual places below the given folders."""
    patterns = {"darwin": _MACOS, "win32": _WINDOWS}.get(platform, _LINUX)
    for root in roots:
        for pattern in patterns:
            for path in sorted(root.glob(pattern)):
                if _NAME.fullmatch(path.name) and path.is_file():
                    yield path


def find(platform: str = sys.platform, roots: tuple[Path, ...] | None = None) -> Path | None:
    """The newest libLLVM in the usual places that is at least :data:`MINIMUM`, or None."""
    if roots is None:
        named = [os.environ.get(name) for name in ("PROGRAMFILES", "PROGRAMFILES(X86)")]
        windows = tuple(Path(name) for name in named if name)
        roots = windows if platform == "win32" else (Path("/"),)
    usable = [p for p in candidates(platform, roots) if version(p)[0] >= MINIMUM]
    return max(usable, key=version, default=None)


def prepare() -> Path | None:
    """Point Dr.Jit at a usable libLLVM, unless the user already did; call it before Dr.Jit starts.

    Returns what :data:`VARIABLE` names now; None where there is nothing usable.
    """
    if not os.environ.get(VARIABLE):
        found = find()
        if found is None:
            return None
        os.environ[VARIABLE] = str(found)
    return Path(os.environ[VARIABLE])


def instruction(platform: str = sys.platform, release: Path = Path("/etc/os-release")) -> str:
    """One line that says how to install LLVM here; Linux distributions are read from `release`."""
    if platform == "darwin":
        return "brew install llvm"
    if platform == "win32":
        return "run the LLVM installer from https://github.com/llvm/llvm-project/releases"
    commands = {
        "debian": "sudo apt-get install libllvm19",
        "fedora": "sudo dnf install llvm-libs",
        "arch": "sudo pacman -S llvm-libs",
    }
    text = release.read_text() if release.is_file() else ""
    named = re.findall(r'^ID(?:_LIKE)?="?([^"\n]*)', text, re.MULTILINE)
    for name in " ".join(named).split():
        if name in commands:
            return commands[name]
    return f"{commands['debian']} (Debian, Ubuntu) or {commands['fedora']} (Fedora)"


def refusal(found: tuple[int, ...] | None) -> str | None:
    """Why a release of LLVM cannot be used and what to do, in one line; None if it can be used.

    `found` is None or negative where there is no LLVM.
    """
    if found and found[0] >= MINIMUM:
        return None
    state = f"found LLVM {found[0]}" if found and found[0] > 0 else "found none"
    return (
        f"rendering needs LLVM {MINIMUM} or newer, {state}: {instruction()}; "
        f"or set {VARIABLE} to the path of its library"
    )


def failure() -> str | None:
    """Why the library that :data:`VARIABLE` names does not load, in one line; None if it does."""
    library = os.environ.get(VARIABLE, "")
    if not Path(library).is_file():
        return None
    try:
        ctypes.CDLL(library)
    except OSError as error:
        return f"LLVM does not load: {error}; or set {VARIABLE} to another library"
    return None


if __name__ == "__main__":
    library = prepare()
    print(library or refusal(None))
    sys.exit(library is None)
