"""Compare instruction sets and numbers of threads on all materials and samplers.

python -m tests.contracts          materials and samplers, in every library, and fits

Prints the tables of docs/results/contracts.md. The first line of each is what the others are
compared with.
"""

from __future__ import annotations

import os
import pickle
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from nacre.brdf import Brdf
from tests.contracts.materials import MATERIALS, made
from tests.contracts.processors import PROCESSORS, run
from tests.contracts.results import FITTED, Results
from tests.contracts.samplers import SAMPLERS
from tests.measured.support import relative_error

PARTS = ("compiled", "numpy", "torch", "drjit")
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def objects() -> Iterator[tuple[str, Brdf]]:
    """Materials whose files and libraries are there, and a white one for each sampler."""
    for name in MATERIALS:
        try:
            brdf = made(name)
            yield name, brdf.replaced(sampler=brdf.sampler)  # the same lobes in all processes
        except pytest.skip.Exception as reason:
            print(f"- without {name}: {reason}")
    white = made("lambert")
    for name, make in SAMPLERS.items():
        yield f"sampler: {name}", white.replaced(sampler=make())


def difference(found: Results, first: Results, part: str) -> str:
    """How many arrays of a library have the same bits, and how far the others are off."""
    names = [name for name in first if name.startswith(f"{part}/")]
    other = [name for name in names if found[name].tobytes() != first[name].tobytes()]
    if not other:
        return f"all {len(names)} the same"
    errors = {name: relative_error(found[name], first[name]) for name in other}
    worst = max(errors, key=lambda name: float(errors[name].max()))
    numbers = np.concatenate([error.ravel() for error in errors.values()])
    return (
        f"{len(names) - len(other)} of {len(names)} the same; of the others 99.9 % within "
        f"{np.quantile(numbers, 0.999):.1e}, all within {numbers.max():.1e} ({worst})"
    )


def fitted(found: Results, first: Results) -> Iterator[str]:
    """A line of a table for each material and thing that is fitted to it."""
    for name in FITTED:
        truth = found.get(f"fits/{name}/truth")
        if truth is None:
            continue
        for part in ("network", "lobes", "model", "table", "code"):
            array = found.get(f"fits/{name}/{part}")
            if array is None:
                continue
            before = first[f"fits/{name}/{part}"]
            same = "the same" if array.tobytes() == before.tobytes() else "not the same"
            off = float(relative_error(array, before).mean())
            error = ""
            if part in ("network", "model", "table"):
                scale = np.abs(truth).mean()
                errors = [float(np.abs(x - truth).mean() / scale) for x in (before, array)]
                error = f"{errors[0]:.4g}, {errors[1]:.4g}"
            yield f"{name} | {part} | {same} | {off:.1e} | {error} |"


def compared(source: Path, rows: list[tuple[str, str, dict[str, str], bool]]) -> None:
    """Print tables of processes, each an instruction set, variables and whether it has one core."""
    found = []
    for title, name, others, alone in rows:
        target = source.with_name(f"{len(found)}.npz")
        before = os.times()
        run(name, source, target, (*PARTS, "fits"), others, alone)
        after = os.times()
        seconds = sum(after[2:4]) - sum(before[2:4])
        print(f"- {title}: {seconds:.0f} s of processor time", flush=True)
        with np.load(target) as arrays:
            found.append((title, dict(arrays)))
    (_, first), *rest = found
    print("\n| " + " | ".join(["", *PARTS]) + " |\n|---" + "|---" * len(PARTS) + "|")
    for title, arrays in rest:
        cells = [difference(arrays, first, part) for part in PARTS]
        print("| " + " | ".join([title, *cells]) + " |")
    print("\n| | of | | bits | mean difference | mean error of both |\n|---|---|---|---|---|---|")
    for title, arrays in rest:
        for line in fitted(arrays, first):
            print(f"| {title} | {line}")
    print(flush=True)


if __name__ == "__main__":
    here = [name for name, processor in PROCESSORS.items() if not processor.missing]
    for name, processor in PROCESSORS.items():
        if processor.missing:
            print(f"- without {name}: {processor.missing}, which this machine has not")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "objects.pickle"
        chosen = dict(objects())
        path.write_bytes(pickle.dumps(chosen))
        print(f"- {len(chosen)} materials and samplers", flush=True)
        two = dict.fromkeys(THREADS, "2")
        rows = [(name, name, two, False) for name in here]
        one = dict.fromkeys(THREADS, "1")
        rows.append((f"{here[0]}, one thread on one core", here[0], one, True))
        compared(path, rows)
