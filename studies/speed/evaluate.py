"""Evaluations of one network a second on one core, against the arithmetic floor.

The floor is the core's peak rate of fused multiply-adds over the 630 that a 6-21-21-3 network
takes. All rows take turns in one run; figures are medians. `python -m studies.speed.evaluate`.
"""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable

from studies.study import Study, data, prevent_oversubscription

prevent_oversubscription()
os.environ["NUMBA_NUM_THREADS"] = "1"

import drjit as dr  # noqa: E402  (thread counts must be set before libraries load)
import numpy as np  # noqa: E402
import torch  # noqa: E402

from nacre import load  # noqa: E402
from nacre.geometry import split  # noqa: E402
from nacre.neural import NeuralBrdf  # noqa: E402
from nacre.render import mitsuba  # noqa: E402
from nacre.render.network import BufferedNetwork  # noqa: E402
from studies.speed.peak import peak  # noqa: E402

_COUNT = 1 << 20


def candidates(brdf: NeuralBrdf) -> dict[str, Callable[[], object]]:
    """What is timed: each call evaluates `_COUNT` pairs of directions."""
    random = np.random.default_rng(0)
    w = random.normal(size=(2, _COUNT, 3)).astype(np.float32)
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    w[..., 2] = np.abs(w[..., 2])
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
        "NumPy, `brdf.eval`": lambda: brdf.eval(w[0], w[1]),
        "PyTorch, `brdf.eval_components`": in_torch,
    }


def main() -> None:
    """Print a Markdown table."""
    study = Study(__doc__, __file__)
    study.add_argument("--rounds", type=int, default=9)
    options = study.options()
    brdf = load(data("pretrained", "rgl", "satin_rosaline_rgb.h5"))
    assert isinstance(brdf, NeuralBrdf)
    timed = candidates(brdf)
    for call in timed.values():
        call()
    rates: dict[str, list[float]] = {name: [] for name in timed}
    floors = []
    for _ in range(options.rounds):
        floors.append(peak() / sum(y.weights.size for y in brdf.layers))
        for name, call in timed.items():
            start = time.perf_counter()
            call()
            rates[name].append(_COUNT / (time.perf_counter() - start))
    floor = statistics.median(floors)
    rows = [("arithmetic floor", f"{floor / 1e6:.1f}", "100 %")]
    for name, values in rates.items():
        fraction = statistics.median(v / f for v, f in zip(values, floors, strict=True))
        rows.append((name, f"{statistics.median(values) / 1e6:.1f}", f"{fraction:.0%}"))
    study.table(("one core", "million evaluations a second", "of the floor"), rows)


if __name__ == "__main__":
    main()
