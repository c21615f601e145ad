"""Where compiled code is kept from one process to the next."""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Iterable
from pathlib import Path

import llvmlite
import llvmlite.binding
import numpy as np
import platformdirs


def code_folder(name: str, sources: Iterable[Path]) -> Path:
    """Folder for the code compiled from sources, for this processor.

    It lies in the user's folder for caches, or in `NUMBA_CACHE_DIR`. Processes on different
    processors that share a home directory have folders of their own.
    """
    libraries = (llvmlite.__version__, np.__version__, sys.version)
    processor = (
        llvmlite.binding.get_host_cpu_name(),
        llvmlite.binding.get_host_cpu_features().flatten(),
    )
    digest = hashlib.sha256(repr((libraries, processor)).encode())
    for path in (Path(__file__), *sources):
        digest.update(path.read_bytes())
    return code_root() / f"{name}-{digest.hexdigest()[:16]}"


def code_root() -> Path:
    """Folder with one folder for each state of code, libraries and processor."""
    named = os.environ.get("NUMBA_CACHE_DIR")
    return Path(named or platformdirs.user_cache_dir("nacre", appauthor=False))
