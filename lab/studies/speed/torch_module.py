"""Evaluations of networks as PyTorch modules a second on one core, against `brdf.eval` of NumPy.

A pass of gradients is that of a sum to weights and directions. All rows take turns in one run;
figures are medians. Compiling takes a minute. `python -m lab.studies.speed.torch_module`.
"""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable
from typing import Any

from lab.studies.study import Study, data, prevent_oversubscription

prevent_oversubscription()
os.environ["NUMBA_NUM_THREADS"] = "1"

import numpy as np  # noqa: E402  (thread counts must be set before libraries load)
import torch  # noqa: E402

from nacre import load  # noqa: E402
from nacre.neural import NeuralBrdf  # noqa: E402
from nacre.neural.torch import NetworkModule, module  # noqa: E402

_COUNT = 1 << 20
_BATCH = 1 << 14
_STACK = 64
Run = Callable[[torch.Tensor, torch.Tensor], Any]


def without_gradients(function: Run) -> Run:
    """A call that keeps nothing for gradients."""

    def run(wi: torch.Tensor, wo: torch.Tensor) -> object:
        with torch.no_grad():
            return function(wi, wo)

    return run


def with_gradients(made: NetworkModule, function: Run) -> Run:
    """A call and the gradients of its sum."""

    def run(wi: torch.Tensor, wo: torch.Tensor) -> object:
        leaves = (wi.detach().requires_grad_(), wo.detach().requires_grad_())
        return torch.autograd.grad(function(*leaves).sum(), (*leaves, *made.parameters()))

    return run


def candidates(brdf: NeuralBrdf) -> dict[str, tuple[int, Run]]:
    """What is timed, and how many pairs it takes at a time."""
    made = module(brdf)
    stack = module([brdf] * _STACK)
    compiled = torch.compile(made, fullgraph=True, dynamic=False)

    def of_stack(wi: torch.Tensor, wo: torch.Tensor) -> object:
        return stack(wi.view(_STACK, -1, 3), wo.view(_STACK, -1, 3))

    return {
        "NumPy, `brdf.eval`": (_COUNT, lambda wi, wo: brdf.eval(wi.numpy(), wo.numpy())),
        "`brdf.eval` of tensors": (_COUNT, brdf.eval),
        "module": (_COUNT, without_gradients(made)),
        "module, batches of 16,384": (_BATCH, without_gradients(made)),
        "compiled module": (_COUNT, without_gradients(compiled)),
        "compiled module, batches of 16,384": (_BATCH, without_gradients(compiled)),
        f"module of {_STACK} networks": (_COUNT, without_gradients(of_stack)),
        "module with gradients, batches of 16,384": (_BATCH, with_gradients(made, made)),
        "compiled with gradients, batches of 16,384": (_BATCH, with_gradients(made, compiled)),
    }


def main() -> None:
    """Print a Markdown table."""
    study = Study(__doc__, __file__)
    study.add_argument("--rounds", type=int, default=9)
    study.add_argument("--network", help="file of a network (default: the satin of the pretrained)")
    options = study.options()
    file = options.network or data("pretrained", "rgl", "satin_rosaline_rgb.h5")
    brdf = load(file)
    assert isinstance(brdf, NeuralBrdf)
    torch.set_num_threads(1)
    random = np.random.default_rng(options.seed)
    w = random.normal(size=(2, _COUNT, 3)).astype(np.float32)
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    w[..., 2] = np.abs(w[..., 2])
    wi, wo = (torch.from_numpy(x) for x in w)
    timed = candidates(brdf)
    rates: dict[str, list[float]] = {name: [] for name in timed}
    for turn in range(options.rounds + 1):
        for name, (count, call) in timed.items():
            parts = list(zip(wi.split(count), wo.split(count), strict=True))
            start = time.perf_counter()
            for part in parts:
                call(*part)
            if turn:  # the first compiles
                rates[name].append(_COUNT / (time.perf_counter() - start))
    first = rates[next(iter(rates))]
    rows = []
    for name, values in rates.items():
        ratio = statistics.median(v / f for v, f in zip(values, first, strict=True))
        rows.append((name, f"{statistics.median(values) / 1e6:.1f}", f"{ratio:.2f}"))
    study.table(("one core", "million evaluations a second", "of NumPy's"), rows)


if __name__ == "__main__":
    main()
