"""Long runs: does memory stay flat, and does a library of 10,000 materials work?

Each of the first parts repeats one thing in one process and notes resident memory after each
round; no two rounds use the same numbers. A least-squares line through the rounds after warm-up
tells what a round leaves behind. Where memory goes up and down in cycles, that is one slope through
the rounds at every place in the cycle, each with a height of its own. `library` fits a folder of
scans by `nacre fit`, kills it by SIGKILL when half of the materials are done, and runs it again
twice.

Figures of each part are kept below the folder of results: a part that is done is not run again
(delete its file to), one that was stopped begins anew, and a library goes on. Linux only.
"""

from __future__ import annotations

import itertools
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import nacre
from lab.studies.optimizing import optimized_codes, optimized_weights
from lab.studies.study import Study, data, log
from nacre.array import Floats
from nacre.geometry import cosine_hemisphere, join
from nacre.io.files import digest
from nacre.measured.deduplication import from_measurement
from nacre.mitsuba import kernels
from nacre.mitsuba.engine import check_llvm
from nacre.neural.nbrdf import NeuralBrdf
from nacre.numerics.mlp import Layer
from nacre.workflows import MANIFEST, Manifest, Record
from nacre.workflows.run import UNFINISHED
from nacre_lab.reproduce.tables import write_text

VARIATION = 0.02
"""Relative standard deviation of the weights of a variant, about those of a published network."""
SCAN = 128
"""Samples of each scan of the library."""
LIBRARY = "--model", "lambert", "--samples", "2000"
"""How the library is fitted: 10,000 fits in the time that one slow core has."""
VARIANTS = 100
_POLL = 0.2  # seconds between two looks at a library that grows


def networks() -> list[Path]:
    """Files of the published networks of MERL materials and of measured RGL materials."""
    return sorted(data("pretrained").glob("*/*.h5"))


def variant(network: NeuralBrdf, seed: int) -> NeuralBrdf:
    """A network of the same shape and lobes, and of weights that no other seed has."""
    random = np.random.default_rng(seed)

    def vary(layer: Layer) -> Layer:
        factors = 1.0 + VARIATION * random.standard_normal(layer.weights.shape)
        return Layer(np.asarray(layer.weights * factors, np.float32), layer.biases)

    return network.with_layers([vary(layer) for layer in network.layers])


def variants() -> Iterator[NeuralBrdf]:
    """Variants without end, of few networks in turn."""
    bases = [nacre.load(path) for path in networks()[::16]]
    for seed, base in enumerate(itertools.cycle(bases)):
        yield variant(base, seed)


def fits() -> Iterator[None]:
    """A network and its lobes from a variant: 4,096 samples, one epoch."""
    recipe = nacre.Recipe(samples=1 << 12, epochs=1)
    for material in variants():
        nacre.fit(material, recipe)
        yield


def loads() -> Iterator[None]:
    """A file of one of the formats, in turn."""
    scans = sorted(data("cornell").glob("*.brdf"))
    paints = sorted(data("mbsdf").glob("carpaint_*.mbsdf"))
    tables = sorted(data("rgl").glob("*.bsdf"))
    for path in itertools.cycle([*tables, *scans, *paints, *networks()[::16]]):
        nacre.load(path)
        yield


def renders() -> Iterator[None]:
    """A preview of 16 x 16 pixels of a variant."""
    from nacre.mitsuba import render_preview

    for material in variants():
        render_preview(material, "sphere", "directional", 16, 1, denoise=False)
        yield


def rounded(layer: Layer) -> Layer:
    """The same in half precision, as nacre's own fits are."""
    return Layer(*(np.float32(np.float16(part)) for part in (layer.weights, layer.biases)))


def halves() -> Iterator[None]:
    """The same of weights in half precision."""
    from nacre.mitsuba import render_preview

    for material in variants():
        half = material.with_layers([rounded(layer) for layer in material.layers])
        render_preview(half, "sphere", "directional", 16, 1, denoise=False)
        yield


def kept() -> Iterator[None]:
    """The same where no kernel is released."""
    kernels.MAX_MATERIALS = sys.maxsize
    yield from renders()


def cooperative() -> Iterator[None]:
    """The same where weights lie in a buffer, so that variants share a kernel."""
    from nacre.mitsuba import bsdf, render_preview

    for material in variants():
        shown = bsdf(material, weights="cooperative")
        render_preview(shown, "sphere", "directional", 16, 1, denoise=False)
        yield


def _literals(numbers: Callable[[np.random.Generator], Floats]) -> Iterator[None]:
    import drjit as dr
    from drjit.llvm import Float

    check_llvm()
    random, x = np.random.default_rng(0), dr.opaque(Float, 0.5, 64)
    while True:
        y = Float(0.0)
        for number in numbers(random):
            y = dr.fma(y, x, Float(float(number)))
        dr.eval(y)
        dr.sync_thread()
        del y
        dr.flush_kernel_cache()
        yield


def numbers() -> Iterator[None]:
    """A kernel of 700 literals that no other has, released at once."""
    return _literals(lambda random: random.standard_normal(700).astype(np.float32))


def orders() -> Iterator[None]:
    """The same, of always the same 700 literals in another order."""
    fixed = np.random.default_rng(1).standard_normal(700).astype(np.float32)
    return _literals(lambda random: random.permutation(fixed))


def encodes() -> Iterator[None]:
    """The code of a variant in the included neural basis."""
    from nacre.latent import find_basis

    basis = find_basis("neural")
    for material in variants():
        basis.encode(material)
        yield


@dataclass(frozen=True)
class Part:
    """What is repeated, how often, and after how many rounds it does the like again."""

    work: Callable[[], Iterator[None]]
    rounds: int
    cycle: int = 1


PARTS = {
    "fits": Part(fits, 500),
    "loads": Part(loads, 500, 20),
    "renders": Part(renders, 300, kernels.MAX_MATERIALS + 1),
    "halves": Part(halves, 300, kernels.MAX_MATERIALS + 1),
    "kept": Part(kept, 60),
    "cooperative": Part(cooperative, 60),
    "numbers": Part(numbers, 50),
    "orders": Part(orders, 50),
    "encodes": Part(encodes, 100),
    "weights": Part(optimized_weights, 500),
    "codes": Part(optimized_codes, 500),
}
WARM_UP = 5
"""One of how many rounds is left out at the beginning, at least."""

COLUMNS = (
    *("part", "rounds", "CPU s a round", "MB after the first"),
    *("most MB, first half", "most MB, second half", "kB a round"),
)
"""Of the table of rounds; halves and kB a round are of the rounds after warm-up."""


def resident() -> int:
    """Resident memory of this process in bytes."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize()


def cpu_seconds() -> float:
    """Of this process so far, all its threads."""
    return sum(os.times()[:2])


def measure(part: Part, rounds: int, path: Path) -> None:
    """Write resident memory after each round, and CPU seconds of all so far, as they come."""
    start, memory = cpu_seconds(), []
    for _ in itertools.islice(part.work(), rounds):
        memory.append(resident())
        write_text(json.dumps({"resident": memory, "cpu": cpu_seconds() - start}), path)
        print(f"\r{len(memory)} of {rounds}  {memory[-1] >> 10} kB ", end="", file=sys.stderr)
    print(file=sys.stderr)


def slope(values: Floats) -> tuple[float, float]:
    """Growth a round and its standard error, of memory as cycles x rounds of each."""
    rounds = np.arange(values.size, dtype=float).reshape(values.shape)
    x, y = rounds - rounds.mean(axis=0), values - values.mean(axis=0)
    square = (x * x).sum()
    growth = (x * y).sum() / square
    freedom = values.size - values.shape[1] - 1
    return growth, float(np.sqrt(np.square(y - growth * x).sum() / freedom / square))


def row(name: str, found: dict[str, Any]) -> list[str]:
    """The cells of one part."""
    memory, cycle = np.array(found["resident"], np.float64), PARTS[name].cycle
    count = max(2, len(memory) * (WARM_UP - 1) // WARM_UP // cycle)
    settled = memory[-count * cycle :]
    growth, error = slope(settled.reshape(count, cycle) / 1e3)
    halves = [half.max() / 1e6 for half in np.array_split(settled, 2)]
    return [
        name,
        f"{len(memory)}",
        f"{found['cpu'] / len(memory):.2f}",
        f"{memory[0] / 1e6:.0f}",
        *(f"{most:.0f}" for most in halves),
        f"{growth:.1f} ± {error:.1f}",
    ]


# A library.


def scan(material: NeuralBrdf, seed: int, path: Path) -> None:
    """Write a material as a measurement at random directions."""
    u = np.random.default_rng(seed).random((4, SCAN), np.float32)
    wi, wo = (join(cosine_hemisphere(*pair)) for pair in (u[:2], u[2:]))
    nacre.save(from_measurement(wi, wo, material.eval(wi, wo), path.stem, isotropic=True), path)


def write_scans(folder: Path, count: int) -> None:
    """Write what is missing of `count` scans of variants of 100 networks."""
    sources = networks()[: -(-count // VARIANTS)]
    for index, source in enumerate(sources):
        numbers = range(index * VARIANTS, min((index + 1) * VARIANTS, count))
        paths = {n: folder / source.stem / f"{n - index * VARIANTS:03}.csv" for n in numbers}
        missing = {n: path for n, path in paths.items() if not path.exists()}
        if missing:
            base = nacre.load(source)
            next(iter(paths.values())).parent.mkdir(parents=True, exist_ok=True)
            for number, path in missing.items():
                scan(variant(base, number), number, path)
            log(f"{numbers.stop} of {count} scans")


@dataclass(frozen=True)
class Run:
    """One run of the command: CPU seconds, peak resident bytes, and how it ended."""

    cpu: float
    peak: int
    status: int


def run(command: list[str], done: Callable[[], bool]) -> Run:
    """Run a command to its end, or kill it once it is `done`."""
    with tempfile.TemporaryFile() as output:
        process = subprocess.Popen(command, stderr=output, stdout=output)
        killed = False
        while True:
            pid, status, usage = os.wait4(process.pid, os.WNOHANG)
            if pid:
                process.returncode = os.waitstatus_to_exitcode(status)
                return Run(
                    usage.ru_utime + usage.ru_stime, usage.ru_maxrss << 10, process.returncode
                )
            if not killed and done():
                process.send_signal(signal.SIGKILL)
                killed = True
            time.sleep(_POLL)


def finished(folder: Path) -> dict[str, Record]:
    """Records of what is fitted."""
    if not folder.is_dir():
        return {}
    return {r.output: r for r in Manifest(folder).records() if r.error is None}


def library(folder: Path, count: int) -> list[list[str]]:
    """Fit a library, killed in the middle: the rows of its table."""
    scans, fitted = folder / "scans", folder / "library"
    start = cpu_seconds()
    write_scans(scans, count)
    rows = [["scans written", f"{cpu_seconds() - start:.1f}", "", f"{count:,} of {SCAN} samples"]]
    command = [sys.executable, "-m", "nacre", "fit", str(scans), "-o", str(fitted), *LIBRARY]
    lines = fitted / MANIFEST

    def half() -> bool:
        with suppress(OSError):  # a finished material leaves two lines
            return lines.read_bytes().count(b"\n") >= count
        return False

    def files(records: dict[str, Record]) -> dict[str, tuple[int, str]]:
        return {
            name: ((fitted / name).stat().st_mtime_ns, digest(fitted / name)) for name in records
        }

    if len(finished(fitted)) < count // 2:
        first = run(command, half)
        done = len(finished(fitted))
        size = lines.stat().st_size / 1e6
        what = f"{done:,} fitted, exit {first.status}, manifest {size:.2f} MB"
        rows.append(["killed at half", f"{first.cpu:.1f}", f"{first.peak / 1e6:.0f}", what])
    before = files(finished(fitted))
    second = run(command, lambda: False)
    after = finished(fitted)
    there = files(after)
    lost = len(before.keys() - there.keys())
    redone = sum(there.get(name, was) != was for name, was in before.items())
    wrong = sum(digest(fitted / name) != r.output_sha256 for name, r in after.items())
    what = (
        f"{len(before):,} there, {redone} redone, {lost} lost; {len(after):,} fitted, {wrong} "
        f"not as the manifest says, exit {second.status}"
    )
    rows.append(["resumed", f"{second.cpu:.1f}", f"{second.peak / 1e6:.0f}", what])
    third = run(command, lambda: False)
    same = sum(was == there[name] for name, was in files(finished(fitted)).items())
    what = f"{same:,} unchanged, exit {third.status}"
    rows.append(["run again", f"{third.cpu:.1f}", f"{third.peak / 1e6:.0f}", what])
    return rows


def manifest(folder: Path, count: int) -> list[list[str]]:
    """Read, list and tidy a manifest as a run of `count` materials leaves it: rows of a table."""
    digests = ["0" * 64] * 4
    with tempfile.TemporaryDirectory(dir=folder) as place:
        path = Path(place) / MANIFEST
        with path.open("w", encoding="utf-8") as file:
            for number in range(count):
                name = f"alum-bronze/{number:07}"
                begun = Record(f"{name}.csv", None, None, None, digests[0], "0.2.0", f"{name}.json")
                known = {"sha256": digests[1], "size": 11_000, "modified": time.time_ns()}
                kept = {"output_sha256": digests[2], "code": digests[3], "losses": {"loss": 0.01}}
                for record in (replace(begun, error=UNFINISHED), replace(begun, **known, **kept)):
                    file.write(json.dumps(asdict(record)) + "\n")
        rows = []

        def step(what: str, work: Callable[[], Any]) -> Any:
            start, memory = cpu_seconds(), resident()
            result = work()
            took, grown = cpu_seconds() - start, (resident() - memory) / 1e6
            size = f"{path.stat().st_size / 1e6:.2f} MB"
            rows.append([what, f"{took:.2f}", f"{grown:+.1f}", size])
            return result

        found = step(f"read {2 * count:,} lines", lambda: Manifest(place))
        listed = step("list the records", found.records)
        step("write one line each", lambda: found.tidy(set()))
        again = step(f"read {count:,} lines", lambda: Manifest(place))
        if not len(listed) == len(again.records()) == count:
            sys.exit("records were lost")
    return rows


LIBRARIES = {"library": (library, "peak MB"), "manifest": (manifest, "MB more")}


def main() -> None:
    study = Study(__doc__, __file__)
    study.add_argument("part", nargs="?", choices=[*PARTS, *LIBRARIES], help="default: all in turn")
    study.add_argument("--rounds", type=int, help="of a part, in place of its own number")
    study.add_argument("--count", type=int, default=10_000, help="materials of the library")
    options = study.options()
    if options.part is None:
        for name in (*PARTS, *LIBRARIES):
            subprocess.run([sys.executable, "-m", "lab.studies.endurance", name, *sys.argv[1:]])
    elif options.part in LIBRARIES:
        work, memory = LIBRARIES[options.part]
        study.table(["", "CPU s", memory, ""], work(study.output, options.count), options.part)
        return
    else:
        part, path = PARTS[options.part], study.output / f"{options.part}.json"
        rounds = options.rounds or part.rounds
        if not path.exists() or len(json.loads(path.read_text())["resident"]) < rounds:
            measure(part, rounds, path)
    found = {name: study.output / f"{name}.json" for name in PARTS}
    study.table(
        COLUMNS,
        [row(name, json.loads(path.read_text())) for name, path in found.items() if path.exists()],
        "rounds",
    )


if __name__ == "__main__":
    main()
