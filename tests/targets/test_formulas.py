"""Formulas at random, written for targets of every kind, run and compared with NumPy."""

from __future__ import annotations

import re

import numpy as np
import pytest

from nacre.array import Array, Components, namespace
from nacre.brdf import Brdf
from nacre.targets import TARGETS, Function
from nacre.targets.program import PAIR
from nacre.targets.slang import SlangLanguage
from tests.oracles.pairs import pairs
from tests.oracles.runner import reference
from tests.oracles.runners import slang
from tests.targets.support import needs, runner
from tests.tiers import tiered

COUNT, STEPS, PAIRS = 20, 14, 300


class Formula:
    """Some operations at random on values that came before them, to three numbers."""

    def __init__(self, seed: int) -> None:
        self.seed = seed

    def __call__(self, wi: Components, wo: Components) -> tuple[Components]:
        self.random, self.xp = np.random.default_rng(self.seed), namespace(*wi, *wo)
        values, mask = [*wi, *wo], wi[0] > wo[0]
        for _ in range(STEPS):
            a, b = (values[-1 - self.random.integers(min(len(values), 8))] for _ in range(2))
            if self.random.random() < 0.15:
                values.extend(self.layer(values))
            elif self.random.random() < 0.1:
                mask = self.compared(a, b, mask)
            else:
                values.append(self.operation(a, b, mask))
        x, y, z = (self.xp.minimum(self.xp.maximum(v, -1e3), 1e3) for v in values[-3:])
        return ((x, y, z),)

    def operation(self, a: Array, b: Array, mask: Array) -> Array:
        xp = self.xp
        number = float(self.random.uniform(-2.0, 2.0))
        ways = (
            lambda: a + b, lambda: a - b, lambda: a * b, lambda: -a, lambda: -(a + b),
            lambda: a - (-b), lambda: number - a, lambda: a * number, lambda: -(a * b) - number,
            lambda: a / (xp.abs(b) + 1.5), lambda: a * b / (a * a + 1.0),
            lambda: xp.where(mask, a, b), lambda: -xp.where(mask, a, -b),
            lambda: xp.minimum(a, b), lambda: xp.maximum(a, number),
            lambda: xp.sqrt(xp.abs(a) + 0.5), lambda: xp.exp(xp.minimum(a, 1.0)),
            lambda: xp.log(xp.abs(a) + 0.1), lambda: xp.sin(a) - xp.cos(-b),
            lambda: xp.arctan2(a, xp.abs(b) + 0.5), lambda: xp.floor(4.0 * a) * b,
        )  # fmt: skip
        result = ways[self.random.integers(len(ways))]()
        return xp.minimum(xp.maximum(result, -20.0), 20.0) if self.random.random() < 0.3 else result

    def compared(self, a: Array, b: Array, mask: Array) -> Array:
        ways = (
            a < b,
            a <= b,
            a > b,
            a >= b,
            ~mask,
            mask & (a < b),
            mask | (a > b),
            ~(mask & (a > b)),
        )
        return ways[self.random.integers(len(ways))]

    def layer(self, values: list[Array]) -> list[Array]:
        """A layer, what may follow one, and sometimes another layer."""
        inputs, outputs = self.random.integers(1, 10, 2)
        taken = [values[self.random.integers(len(values))] for _ in range(inputs)]
        sums = self.xp.dense(taken, *self.weights(inputs, outputs))
        ways = (
            lambda x: x,
            lambda x: self.xp.maximum(x, 0.0),
            lambda x: self.xp.maximum(x, 0.0) * x,
            lambda x: -(x + 1.0),
        )
        way = ways[self.random.integers(len(ways))]
        found = [way(x) for x in sums]
        if self.random.random() < 0.5:
            found += self.xp.dense(found, *self.weights(outputs, 3))
        return found

    def weights(self, inputs: int, outputs: int) -> tuple[np.ndarray, np.ndarray]:
        weights = self.random.normal(size=(inputs, outputs)) / inputs
        return weights.astype(np.float32), self.random.normal(size=outputs).astype(np.float32)


@pytest.mark.slow
def test_formulas_of_all_operations_are_written_as_they_are() -> None:
    needs(slang.Slang().missing())
    formulas = {f"f{seed}": Formula(seed) for seed in range(COUNT)}
    text = "\n".join(
        SlangLanguage().function(Function.of("eval", formula, PAIR, ("rgb",)), name)
        for name, formula in formulas.items()
    )
    values = {name: f"float4({name}(a[id.x].xyz, b[id.x].xyz), 0.0)" for name in formulas}
    files = {"m.slang": text.encode()}
    library = slang.built(files, slang.shader("m", values))
    a, b = np.random.default_rng(0).normal(size=(2, PAIRS, 3)).astype(np.float32)
    double = [tuple(w.astype(np.float64).T) for w in (a, b)]
    for name, formula in formulas.items():
        call = slang.Call(library, name, a, b)
        call()
        expected = np.stack(np.broadcast_arrays(*formula(*double)[0]), axis=-1)
        close = np.isclose(call.result[:, :3], expected, rtol=1e-3, atol=1e-3)
        # Where a condition is about equal numbers, single precision may decide otherwise.
        assert close.all(axis=1).mean() > 0.97, name


class Written(Brdf):
    """A formula at random as a reflectance."""

    isotropic = False

    def __init__(self, seed: int) -> None:
        super().__init__()
        self.seed = seed

    def eval_components(self, wi: Components, wo: Components) -> Components:
        return Formula(self.seed)(wi, wo)[0]


@pytest.mark.parametrize(
    ("tool", "count"),
    tiered(
        [("onnxruntime", 40), ("pytorch", 40), ("opengl", 20), ("c", 2)],
        [("opengl", 20), ("c", 2)],
    ),
)
def test_formulas_are_what_other_targets_compute(tool: str, count: int) -> None:
    run = runner(tool)
    wi, wo = (w[1 : 2 * PAIRS : 2] for w in pairs(10_000))
    for seed in range(count):
        brdf = Written(seed)
        found = run.run(TARGETS[run.target]().files(brdf, "m"), "m", "eval", wi, wo)
        close = np.isclose(found, reference(brdf, "eval", wi, wo), rtol=2e-3, atol=2e-3)
        assert close.all(axis=1).mean() > 0.97, seed


def test_vectors_that_begin_alike_have_names_of_their_own() -> None:
    def formula(wi: Components, wo: Components) -> tuple[Array]:
        xp = namespace(*wi, *wo)
        units = xp.dense([*wi, *wo], np.ones((6, 4), np.float32), np.zeros(4, np.float32))
        weights = np.ones((4, 1), np.float32), np.zeros(1, np.float32)
        products = [[x * units[0] for x in units], [x * x for x in units]]
        products.append([x * units[3] for x in units])
        return (sum(xp.dense(each, *weights)[0] for each in products),)

    text = SlangLanguage().function(Function.of("eval", formula, PAIR, ("value",)), "f")
    names = re.findall(r"^ +float\d? (\w+) =", text, re.MULTILINE)
    assert len(names) == len(set(names)) >= 4
