"""Evaluations a second: of one network by several libraries, and of all kinds of materials.

One network on one core is compared with the arithmetic floor, the core's peak rate of fused
multiply-adds over the 630 that a 6-21-21-3 network takes. Then `eval`, `sample` and `pdf` of
networks, lobes and tables: compiled, and by the formula on NumPy arrays that they are compiled
from. All rows of a table take turns in one run; figures are medians, of processor time on one
core and of time that passed on all.
`python -m lab.studies.speed.evaluate`.
"""

from __future__ import annotations

import itertools
import os
import statistics
import time
from collections.abc import Callable, Mapping
from unittest import mock

from lab.studies.study import Study, data, prevent_oversubscription

prevent_oversubscription()
os.environ["NUMBA_NUM_THREADS"] = "1"

import drjit as dr  # noqa: E402  (thread counts must be set before libraries load)
import numpy as np  # noqa: E402
import torch  # noqa: E402

from lab.studies.speed.peak import peak  # noqa: E402
from nacre import Brdf, load  # noqa: E402
from nacre.geometry import split  # noqa: E402
from nacre.measured import merl  # noqa: E402
from nacre.mitsuba import mitsuba  # noqa: E402
from nacre.mitsuba.network import BufferedNetwork  # noqa: E402
from nacre.neural import Layer, NeuralBrdf  # noqa: E402
from nacre.sampling import GgxMixture  # noqa: E402

_COUNT = 1 << 20


Calls = Mapping[str, Callable[[], object]]


def directions() -> np.ndarray:
    """Pairs of unit vectors above the horizon, shape (2, `_COUNT`, 3)."""
    w = np.random.default_rng(0).normal(size=(2, _COUNT, 3)).astype(np.float32)
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    w[..., 2] = np.abs(w[..., 2])
    return w


def plain(call: Callable[[], object]) -> Callable[[], object]:
    """The same by NumPy."""

    def run() -> object:
        with mock.patch("nacre.brdf.compiled", return_value=None):
            return call()

    return run


def candidates(brdf: NeuralBrdf) -> Calls:
    """What is timed of one network: each call evaluates `_COUNT` pairs of directions."""
    w = directions()
    mi = mitsuba("llvm_ad_rgb")
    dr.set_thread_count(1)
    torch.set_num_threads(1)
    traced = [tuple(mi.Float(np.ascontiguousarray(c)) for c in split(x)) for x in w]
    tensors = [tuple(torch.from_numpy(np.ascontiguousarray(c)) for c in split(x)) for x in w]
    cooperative = BufferedNetwork(brdf, mi)
    buffer = cooperative.initial()

    def in_torch() -> object:
        with torch.no_grad():
            return brdf.eval_components(*tensors)

    def in_drjit(function: Callable[..., object]) -> Callable[[], object]:
        def run() -> object:
            dr.eval(result := function(*traced))
            dr.sync_thread()
            return result

        return run

    return {
        "Dr.Jit, weights as literals": in_drjit(brdf.eval_components),
        "Dr.Jit, cooperative vectors": in_drjit(
            lambda wi, wo: cooperative.eval_components(buffer, wi, wo)
        ),
        "`brdf.eval`": lambda: brdf.eval(w[0], w[1]),
        "NumPy, the formula of `brdf.eval`": plain(lambda: brdf.eval(w[0], w[1])),
        "PyTorch, `brdf.eval_components`": in_torch,
    }


def kinds(paper: NeuralBrdf) -> Calls:
    """Calls of all kinds of materials, of `_COUNT` pairs each."""
    random = np.random.default_rng(1)
    sizes = (6, 21, 21, 3)
    layers = [Layer(random.normal(0.0, 0.4, x), np.zeros(x[1])) for x in itertools.pairwise(sizes)]
    enhanced = NeuralBrdf(layers, inputs="enhanced")
    table = load(data("rgl", "satin_rosaline_rgb.bsdf"))
    merl_table = merl.tabulate(load(data("pretrained", "merl", "chrome.h5")))
    w, u = directions(), random.random((_COUNT, 3), np.float32)
    assert isinstance(paper.sampler, GgxMixture)
    lobes = len(paper.sampler.lobes)

    def evaluated(brdf: Brdf) -> Callable[[], object]:
        return lambda: brdf.eval(w[0], w[1])

    return {
        "network, paper inputs: `eval`": evaluated(paper),
        "network, enhanced inputs: `eval`": evaluated(enhanced),
        f"{lobes} lobes: `sample`": lambda: paper.sample(w[1], u),
        f"{lobes} lobes: `pdf`": lambda: paper.pdf(w[0], w[1]),
        "RGL table: `eval`": evaluated(table),
        "RGL table: `sample`": lambda: table.sample(w[1], u),
        "RGL table: `pdf`": lambda: table.pdf(w[0], w[1]),
        "MERL table: `eval`": evaluated(merl_table),
    }


def rates(
    calls: Calls, rounds: int, clock: Callable[[], float] = time.process_time
) -> dict[str, list[float]]:
    """Pairs a second of every call in each of the rounds, in which they take turns.

    Seconds of the process on its cores, whatever else they do, or those of another clock.
    """
    for call in calls.values():
        call()
    found: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(rounds):
        for name, call in calls.items():
            start = clock()
            call()
            found[name].append(_COUNT / (clock() - start))
    return found


def main() -> None:
    """Print a Markdown table."""
    study = Study(__doc__, __file__)
    study.add_argument("--rounds", type=int, default=9)
    options = study.options()
    brdf = load(data("pretrained", "rgl", "satin_rosaline_rgb.h5"))
    assert isinstance(brdf, NeuralBrdf)
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(cores)})
    products = sum(layer.weights.size for layer in brdf.layers)
    floors: list[float] = []

    def measure_floor() -> None:
        floors.append(peak() / products)

    found = rates({"": measure_floor, **candidates(brdf)}, options.rounds)
    del found[""], floors[0]
    floor = statistics.median(floors)
    rows = [("arithmetic floor", f"{floor / 1e6:.1f}", "100 %")]
    for name, values in found.items():
        fraction = statistics.median(v / f for v, f in zip(values, floors, strict=True))
        rows.append((name, f"{statistics.median(values) / 1e6:.1f}", f"{fraction:.0%}"))
    study.table(("one core", "million evaluations a second", "of the floor"), rows)

    calls = kinds(brdf)
    one = rates({**calls, **{f"plain {k}": plain(v) for k, v in calls.items()}}, options.rounds)
    os.sched_setaffinity(0, cores)
    every = rates(calls, options.rounds, time.perf_counter)
    rows = []
    for name in calls:
        fast, slow = one[name], one[f"plain {name}"]
        ratio = statistics.median(a / b for a, b in zip(fast, slow, strict=True))
        shown = (statistics.median(x) / 1e6 for x in (slow, fast, every[name]))
        rows.append((name, *(f"{x:.1f}" for x in shown), f"{ratio:.0f}x"))
    head = "million pairs a second", "NumPy, one core", "compiled, one core"
    study.table((*head, f"compiled, {len(cores)} cores", "faster, on one"), rows)


if __name__ == "__main__":
    main()
