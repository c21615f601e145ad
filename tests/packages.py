"""Example packages as users install them."""

from __future__ import annotations

import importlib
import shutil
import subprocess
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from nacre.registry import Registry


def pip_installed(source: Path, folder: Path) -> Path:
    """A folder of packages that has a source tree's, as pip installs it without a network."""
    shutil.copytree(source, folder / "source", ignore=shutil.ignore_patterns("__pycache__"))
    options = "--no-deps --no-build-isolation --no-index --disable-pip-version-check -q --target"
    pip = [sys.executable, "-m", "pip", "install", *options.split()]
    subprocess.run([*pip, str(folder / "site"), str(folder / "source")], check=True)
    return folder / "site"


@contextmanager
def found_in(
    site: Path, package: str, registries: Iterable[Registry], monkeypatch: pytest.MonkeyPatch
) -> Iterator[None]:
    """A block in which registries find what a package in a folder of packages brings."""
    monkeypatch.syspath_prepend(site)
    for registry in registries:
        monkeypatch.setattr(registry, "_entry_points", None)
        monkeypatch.setattr(registry, "_members", {})
    importlib.invalidate_caches()
    yield
    for name in [name for name in sys.modules if name.partition(".")[0] == package]:
        del sys.modules[name]
