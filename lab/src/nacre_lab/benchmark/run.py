"""A run of the benchmark, which measures and adds the rows missing from the results file."""

from __future__ import annotations

import datetime
import inspect
import platform
import shlex
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from importlib import metadata
from pathlib import Path
from typing import Any

import nacre
from nacre.errors import DISTRIBUTION, NacreError, require
from nacre.formats import load_brdf
from nacre.io.files import digest
from nacre.runtime.code_fingerprint import code_fingerprint
from nacre.runtime.parallel import core_count
from nacre.runtime.progress import Progress, named, silent
from nacre_lab.benchmark.methods import Bases, find_methods, methods
from nacre_lab.benchmark.protocol import PROTOCOLS, VERSION, measure
from nacre_lab.benchmark.results import Row, open_results
from nacre_lab.benchmark.splits import Split
from nacre_lab.reproduce.cache import cache_key
from nacre_lab.reproduce.trial import Method, Reference

_LIBRARIES = "numpy", "scipy", "numba", "scikit-image", "torch"
_DECIDING = "methods", "protocol", "splits"
"""Modules of the benchmark that determine the results, with all that they import."""


@dataclass(frozen=True)
class Outcome:
    """The result of a run.

    Parameters
    ----------
    rows
        All requested rows in order, by material.
    measured
        Number of rows measured now; the others were in the file.
    """

    rows: Sequence[Row]
    measured: int


def run(
    split: Split,
    output: Path,
    *,
    names: Sequence[str] = (),
    only: Sequence[str] = (),
    folder: Path | None = None,
    protocol: str = "full",
    cache: Path | None = None,
    fresh: bool = False,
    progress: Progress = silent,
) -> Outcome:
    """Measure the rows missing from the results file, one by one, so that times are comparable.

    Parameters
    ----------
    split
        The materials; see also :func:`nacre_lab.benchmark.splits.given`.
    output
        The results file to add rows to.
    names
        Methods; all but the slow ones if empty.
    only
        Materials; all of the split if empty.
    folder
        Folder with the measured files of the split's database.
    protocol
        One of :data:`nacre_lab.benchmark.protocol.PROTOCOLS`.
    cache
        Folder for trained bases; beside the output if None.
    fresh
        Measure existing rows again.
    progress
        Called with the progress.

    Raises
    ------
    NacreError
        If a method or material is unknown, a file is missing or not the expected one, or the output
        cannot be extended. If a method cannot represent a material, a row tells why.
    """
    require("skimage.metrics", "render")
    settings = PROTOCOLS[protocol]
    cache = cache or output.with_name(f"{output.name}.cache")
    bases = Bases(split, folder, settings, cache, named(progress, "bases"))
    known = methods(settings, bases)
    chosen = find_methods(tuple(names), known)
    paths = {name: split.path(name, folder) for name in split.chosen(only)}
    facts = {"name": protocol, "version": VERSION, **settings.facts, "environment": "studio"}
    deciding = (f"nacre_lab.benchmark.{name}" for name in _DECIDING)
    code = code_fingerprint(*deciding, within=("nacre",))
    rows: list[Row] = []
    measured, total = 0, len(paths) * len(chosen)
    with open_results(output, fresh=fresh) as results:
        for material, path in paths.items():
            sha256, reference = digest(path), None
            for name, method in chosen.items():
                row = _row(split, material, sha256, name, method, facts, code)
                found = results.find(row.key)
                if found is None:
                    progress("benchmark", len(rows), total, f"{material}, {name}")
                    reference = reference or Reference(material, load_brdf(path), settings)
                    found = _measured(row, reference, method)
                    results.keep(found)
                    measured += 1
                rows.append(found)
                progress("benchmark", len(rows), total, f"{material}, {name}")
    return Outcome(rows, measured)


def _row(
    split: Split,
    material: str,
    sha256: str,
    name: str,
    method: Method,
    protocol: Mapping[str, Any],
    code: str,
) -> Row:
    """A row without results."""
    settings = dict(method.settings)
    own = [code, _package_code(method)]
    key = cache_key("bench", [split.name, material, sha256, name, settings, protocol, own])
    where = ["FILES"] if split.files is not None else ["--split", split.name]
    words = ["nacre", "bench", *where, "--methods", name, "--only", material]
    if split.database is not None:
        words += ["--measured", "FOLDER"]
    if protocol["name"] == "quick":
        words.append("--quick")
    return Row(
        split.name,
        material,
        name,
        key,
        about=method.about,
        family=method.family,
        protocol=dict(protocol),
        sha256=sha256,
        settings=settings,
        command=shlex.join(words),
    )


def _measured(row: Row, reference: Reference, method: Method) -> Row:
    """The row with its results, and the versions and machine behind them."""
    now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    row = replace(row, versions=_versions(method), machine=_machine(), date=now)
    try:
        values, reasons = measure(reference, row.method, method)
    except NacreError as error:
        return replace(row, unavailable=str(error))
    return replace(row, measures=values, missing=reasons)


def _package(method: Method) -> str:
    """The module of a method from another package; empty for those of the lab."""
    module = inspect.getmodule(method.fit)
    name = module.__name__ if module else ""
    return "" if name.partition(".")[0] in ("nacre", "nacre_lab") else name


def _package_code(method: Method) -> str:
    """Fingerprint of the code of a method from another package, if it is Python."""
    found = ""
    with suppress(ValueError, SyntaxError, ImportError):
        if name := _package(method):
            found = code_fingerprint(name)
    return found


def _versions(method: Method) -> dict[str, str]:
    found = {DISTRIBUTION: nacre.__version__, "python": platform.python_version()}
    package = _package(method).partition(".")[0]
    own = metadata.packages_distributions().get(package, []) if package else []
    for name in (*_LIBRARIES, *own):
        with suppress(metadata.PackageNotFoundError):
            found[name] = metadata.version(name)
    return found


def _machine() -> dict[str, Any]:
    return {
        "system": platform.system(),
        "processor": _processor(),
        "cores": core_count(),
    }


def _processor() -> str:
    """The name of the processor, if it can be found."""
    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
