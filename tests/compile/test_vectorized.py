"""Compiled formulas: elementary functions, layers, gathers, code on disk, other processors."""

from __future__ import annotations

import gc
import itertools
import math
import sys

import numpy as np
import pytest

from nacre.array import Table, namespace
from nacre.brdf import Brdf
from nacre.compile import pairs, vectorized
from nacre.compile.trace import UntraceableError
from nacre.compile.vectorized import VectorFunction
from nacre.numerics.mlp import Layer, forward
from nacre.sampling import BlinnPhongMixture
from nacre.sampling.mixture import GgxLobe, GgxMixture

RANDOM = np.random.default_rng(0)


def run(formula, a, b=None):
    """The only array of a formula of two vectors, whose rows are given."""

    def whole(a, b):
        return (formula(a, b),), a[0] != a[0]

    b = np.zeros_like(a) if b is None else b
    (found,), fault = VectorFunction(whole)(a, b)
    assert not fault
    return found


def of_each(name, *arguments):
    """A function of the namespace, of numbers one by one."""
    a, b = (np.zeros((len(arguments[0]), 3), np.float32) for _ in range(2))
    for array, values in zip((a, b), arguments, strict=False):
        array[:, 1] = values

    def formula(a, b):
        return getattr(namespace(a[1]), name)(*(x[1] for x in (a, b)[: len(arguments)]))

    return run(formula, a, b)


def logarithmic(low, high, count=20_000):
    return np.exp(np.linspace(math.log(low), math.log(high), count)).astype(np.float32)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("exp", np.linspace(-87.0, 88.7, 50_000, dtype=np.float32)),
        ("exp", np.linspace(-1e-3, 1e-3, 2_000, dtype=np.float32)),
        ("log", logarithmic(1.2e-38, 3e38)),
        ("log", np.linspace(0.5, 2.0, 20_000, dtype=np.float32)),
        ("arcsin", np.linspace(-1.0, 1.0, 20_000, dtype=np.float32)),
        ("sqrt", logarithmic(1e-38, 3e38)),
    ],
)
def test_functions_are_close_in_all_digits(name, values):
    exact = getattr(np, name)(values.astype(np.float64))
    places = np.spacing(np.abs(exact).astype(np.float32), dtype=np.float32)
    limit = 4.0 if name == "arcsin" else 1.0
    assert (np.abs(of_each(name, values) - exact) / places).max() <= limit


@pytest.mark.parametrize("name", ["sin", "cos"])
def test_circular_functions_are_close(name):
    values = np.linspace(-30.0, 30.0, 100_000, dtype=np.float32)
    exact = getattr(np, name)(values.astype(np.float64))
    np.testing.assert_allclose(of_each(name, values), exact, atol=1.2e-7)


def test_angles_of_points_are_close_all_around():
    angle = np.linspace(-math.pi, math.pi, 50_001)
    y, x = (np.float32(1e-3) * f(angle).astype(np.float32) for f in (np.sin, np.cos))
    exact = np.arctan2(y.astype(np.float64), x.astype(np.float64))
    np.testing.assert_allclose(of_each("arctan2", y, x), exact, rtol=3e-7, atol=1e-12)


def test_zeros_infinities_and_what_is_no_number():
    inf, nan = math.inf, math.nan
    with np.errstate(all="ignore"):
        for name, values in {
            "exp": (-inf, -104.0, -95.0, 88.7, 89.0, inf, nan, 0.0, -0.0),
            "log": (0.0, -0.0, -1.0, inf, -inf, nan, 1.0, 1e-40, 1e-45),
            "floor": (-0.5, 0.5, 2.0, nan),
            "abs": (-0.0, -3.0, nan),
        }.items():
            values = np.float32(values)
            expected = getattr(np, name)(values)
            np.testing.assert_allclose(of_each(name, values), expected, rtol=3e-7, atol=2e-45)
    zeros = np.float32([0.0, -0.0, 0.0, -0.0]), np.float32([0.0, 0.0, -0.0, -0.0])
    np.testing.assert_array_equal(of_each("arctan2", *zeros), np.arctan2(*zeros))


def test_what_is_no_number_stays_so_in_a_clamp():
    values = np.zeros((3, 3), np.float32)
    values[:, 1] = (-1.0, 2.0, math.nan)

    def clamped(a, b):
        xp = namespace(a[1])
        return xp.minimum(0.5, xp.maximum(b[1] + a[1], 0.0))

    np.testing.assert_array_equal(run(clamped, values), np.float32([0.0, 0.5, math.nan]))


@pytest.mark.parametrize("sizes", [(1, 1), (3, 25), (6, 1, 49, 2), (5, 64, 24, 7)])
def test_layers_of_odd_sizes(sizes):
    layers = [
        Layer(RANDOM.normal(size=(a, b)), RANDOM.normal(size=b))
        for a, b in itertools.pairwise(sizes)
    ]
    w = RANDOM.normal(size=(2, 100, 3)).astype(np.float32)
    inputs = [*w[0].T, *w[1].T][: sizes[0]]

    def last(a, b):
        return forward([*a, *b][: sizes[0]], layers)[-1]

    expected = forward(np.stack(inputs, -1).astype(np.float64), layers)[:, -1]
    np.testing.assert_allclose(run(last, w[0], w[1]), expected, rtol=1e-4, atol=1e-4)


def test_layers_of_constant_inputs():
    layer = Layer(RANDOM.normal(size=(3, 2)), RANDOM.normal(size=2))
    w = RANDOM.random((20, 3)).astype(np.float32)
    for constant in (0.0, 2.0):
        found = run(lambda a, _, c=constant: forward([0.0 * a[0] + c, c, 0.0], [layer])[1], w)
        expected = constant * layer.weights[:2, 1].sum() + layer.biases[1]
        np.testing.assert_allclose(found, np.full(20, expected), rtol=1e-6)


def test_tables_are_gathered_from_where_arrays_are():
    table = Table(RANDOM.random((7, 11)))
    w = RANDOM.random((200, 3)).astype(np.float32)

    def formula(a, _):
        xp = namespace(*a)
        row, column = xp.to_index(a[0] * 7.0), xp.to_index(a[1] * 10.0)
        last = xp.where(column + 1 >= xp.minimum(10, 12), 0 * column, column + 1)
        value = xp.take(table, row * 11 + column) - xp.take(table, row * 11 + column + 1)
        return value + xp.to_float(last, a[0]) * xp.take(table, last)

    np.testing.assert_allclose(run(formula, w), formula(tuple(w.T), None), rtol=1e-6, atol=1e-7)


def test_numbers_are_data_of_the_code(monkeypatch):
    asked = []
    code = vectorized._code
    monkeypatch.setattr(vectorized, "_code", lambda p: asked.append(p) or code(p))
    w = RANDOM.random((50, 3)).astype(np.float32)
    for factor in (2.5, 3.25, -7.0):
        found = run(lambda a, b, factor=factor: a[0] * factor + b[2], w, w)
        np.testing.assert_array_equal(found, w[:, 0] * np.float32(factor) + w[:, 2])
    assert len(asked) <= 1


def test_lobes_of_all_numbers_share_code(monkeypatch):
    asked = set()
    compile_program = vectorized._compiled
    monkeypatch.setattr(vectorized, "_compiled", lambda p: asked.add(p) or compile_program(p))
    w = np.float32([[0.0, 0.6, 0.8], [0.8, 0.0, 0.6]])
    for numbers in ((0.5, 0.2, 0.3), (0.0, 0.25, 0.25), (1.0, 1.0, 4.0), (0.0, 0.0, 0.002)):
        a, b, c = numbers
        lobe = GgxLobe((a, 0.5), (c, 1.0), (c, c), (a, b))
        sampler = GgxMixture((lobe,), (0.0, b / 4), (0.0, 0.0), (0.1, 0.7))
        brdf = Chosen(sampler=sampler)
        exact = sampler.pdf_components(tuple(w.T.astype(float)), tuple(w.T.astype(float)))
        np.testing.assert_allclose(brdf.pdf(w, w), exact, rtol=1e-5)
        brdf.sample(w, w * 0.9)
    assert len(asked) == 2


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(vectorized, "_loaded", {})
    vectorized._folder.cache_clear()
    yield tmp_path
    vectorized._folder.cache_clear()


def test_code_is_kept_and_damaged_code_is_made_anew(folder, monkeypatch):
    w = RANDOM.random((50, 3)).astype(np.float32)
    made = []
    module = vectorized.module
    monkeypatch.setattr(vectorized, "module", lambda p: made.append(p) or module(p))

    def again():
        vectorized._loaded.clear()
        np.testing.assert_array_equal(run(lambda a, _: a[0] + a[1], w), w[:, 0] + w[:, 1])
        return len(made)

    assert [again(), again()] == [1, 1]
    (path,) = folder.glob("*/*.o")
    whole = path.read_bytes()
    for damage in (b"", whole[:100], whole[:-1], whole[:99] + bytes([whole[99] ^ 1]) + whole[100:]):
        path.write_bytes(damage)
        before = len(made)
        assert [again() - before, again() - before] == [1, 1]
        assert path.read_bytes() == whole


def test_without_a_folder_formulas_are_compiled(folder, monkeypatch):
    (folder / "file").touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(folder / "file"))
    w = np.ones((5, 3), np.float32)
    np.testing.assert_array_equal(run(lambda a, _: a[0] + 2.0, w), np.full(5, 3.0))


class Chosen(Brdf):
    """A formula that asks for values before they are computed."""

    def eval_components(self, wi, wo):
        f = np.sqrt(wi[2]) if np.all(wo[2] > 0.5) else wi[2]
        return f, f, f


def test_what_does_not_compile_is_evaluated_by_numpy():
    w = np.float32([[0.0, 0.6, 0.8], [0.8, 0.0, 0.6]])
    expected = np.repeat(np.sqrt(w[:, 2:]), 3, 1)
    np.testing.assert_array_equal(Chosen().eval(w, w), expected)


def test_a_formula_without_end_is_not_compiled():
    def long(a, b):
        total = a[0]
        for k in range(20_000):
            total = total * b[0] + float(k)
        return total

    with pytest.raises(UntraceableError, match="so long"):
        run(long, np.ones((1, 3), np.float32))


def test_without_llvm_numpy_evaluates(monkeypatch):
    monkeypatch.setitem(sys.modules, "nacre.compile.vectorized", None)
    brdf, w = Chosen(sampler=BlinnPhongMixture(0.0, 1.0)), np.float32([[0.0, 0.6, 0.8]])
    assert brdf.pdf(w, w) == pytest.approx(0.8 / math.pi)
    assert [pairs._known[key] for key in pairs._known if key[0] == id(brdf.sampler)] == [None]


def test_code_is_forgotten_with_its_material():
    brdf, w = Chosen(), np.float32([0.0, 0.6, 0.8])
    brdf.eval(w, w)
    key = id(brdf)
    assert any(owner == key for owner, _ in pairs._known)
    del brdf
    gc.collect()
    assert not any(owner == key for owner, _ in pairs._known)
