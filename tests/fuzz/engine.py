"""The process that atheris runs in: one reader, until its time is over or it dies."""

from __future__ import annotations

import argparse
import ctypes
import os
import resource
from pathlib import Path
from random import Random
from typing import Any

MEMORY_LIMIT = 2 << 30
"""Bytes of address space that the process may take beyond what it has at the start."""
_GROWN = 1 << 30
"""Bytes in memory with which a process leaves its work to a new one: fuzzing itself leaks."""
_SHORTEST_LIMIT = 1 << 15
"""Inputs may be at least this long; longer where whole files are."""
_REBUILT, _PATCHED = 0.3, 0.4


def main() -> None:
    """Fuzz one reader; does not return."""
    import atheris

    included = ["nacre", "zipfile", "json", "numpy.lib"]
    with atheris.instrument_imports(include=included, exclude=_compiled()):
        from tests.fuzz.cases import cases
        from tests.fuzz.target import target
        from tests.specimens import mutated

        known = cases()
    parser = argparse.ArgumentParser()
    parser.add_argument("format")
    parser.add_argument("output", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("seconds", type=int)
    arguments = parser.parse_args()
    entry, specimen = known[arguments.format]
    corpus = arguments.output / "corpus"
    corpus.mkdir(exist_ok=True)
    files = specimen.files()
    longest = max(_SHORTEST_LIMIT, *(len(content) + 64 for content in files))
    for index, content in enumerate(files):
        (corpus / f"seed-{index}").write_bytes(content)

    def mutate(data: bytes, size: int, seed: int) -> bytes:
        random = Random(seed)
        choice = random.random()
        if choice < _REBUILT:
            return specimen.rebuild(data, random)[:size]
        if choice < _REBUILT + _PATCHED:
            return mutated(data, random)[:size]
        return bytes(atheris.Mutate(data, size))

    with target(entry, specimen, arguments.output, arguments.folder) as test:

        def run(data: bytes) -> None:
            test(data)
            if test.figures.executed % 128 == 0 and _memory()[1] > _GROWN:
                test.write_figures()
                os._exit(0)

        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        resource.setrlimit(resource.RLIMIT_AS, (_memory()[0] + MEMORY_LIMIT, hard))
        flags = [
            "fuzz",
            str(corpus),
            f"-artifact_prefix={arguments.output}/crash-",
            f"-max_total_time={arguments.seconds}",
            f"-max_len={longest}",
            "-timeout=120",
            "-report_slow_units=120",  # wall time, which other programs take; see TIME_LIMIT
            "-rss_limit_mb=4096",
            "-print_final_stats=1",
        ]
        atheris.Setup(flags, run, custom_mutator=mutate)
        leave = _leave_at_once()  # which must outlive the call
        atheris.Fuzz()
        del leave


def _compiled() -> list[str]:
    """Modules with functions for Numba, which does not compile them once they are instrumented."""
    source = Path(__file__).parents[2] / "src"
    paths = [p for p in source.rglob("*.py") if "@compiled" in p.read_text(encoding="utf-8")]
    return [".".join(path.relative_to(source).with_suffix("").parts) for path in paths]


def _memory() -> tuple[int, int]:
    """Bytes of address space, and of memory, that the process takes."""
    pages = Path("/proc/self/statm").read_text().split()
    return int(pages[0]) * resource.getpagesize(), int(pages[1]) * resource.getpagesize()


def _leave_at_once() -> Any:
    """End the process where it would begin to: Mitsuba's threads, still running, would abort it.

    Returns
    -------
    handle
        Of the C callback, to be kept.
    """
    callback = ctypes.CFUNCTYPE(None, ctypes.c_int, ctypes.c_void_p)(
        lambda status, _: os._exit(status)
    )
    ctypes.CDLL(None).on_exit(callback, None)
    return callback


if __name__ == "__main__":
    main()
