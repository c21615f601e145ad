"""What every reflectance in the package promises, on every one of them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest

from nacre.brdf import Brdf, _validity, eval_formula, pdf_formula, sample_formula
from nacre.compile.pairs import compiled
from nacre.errors import NacreError
from nacre.mitsuba import bsdf
from nacre.neural import Layer, NeuralBrdf
from nacre.sampling import UniformSampler
from nacre.testing.brdf import CONTRACTS
from tests.contracts.classes import concrete
from tests.contracts.directions import awkward_pairs, pairs
from tests.contracts.materials import FEW, MATERIALS, made
from tests.tiers import tiered
from tests.variants import require_mitsuba


@pytest.fixture(scope="module", params=tiered(MATERIALS, FEW))
def brdf(request: pytest.FixtureRequest) -> Brdf:
    return made(request.param)


def test_every_kind_is_here():
    kinds = {type(made(name)) for name in MATERIALS if "." not in name}
    left = {kind.__name__ for kind in concrete(Brdf) - kinds}
    assert left == {"MitsubaBrdf", "WrappedBrdf"}  # windows onto Mitsuba, and onto others' code


@pytest.mark.parametrize("contract", CONTRACTS)
def test_contracts_of_reflectances(brdf, contract):
    CONTRACTS[contract](brdf)


def test_drjit_gives_what_numpy_gives(brdf):
    mi = require_mitsuba()
    import drjit as dr

    if not brdf.traceable:
        if not hasattr(brdf, "latent"):  # which is rendered as a texture
            with pytest.raises(NacreError, match="fit a network"):
                bsdf(brdf)
        return
    wi, wo = pairs()
    traced = [tuple(mi.Float(np.ascontiguousarray(c)) for c in w.T) for w in (wi, wo)]
    components = brdf.eval_components(*traced)
    dr.eval(*components)  # as one kernel
    values = np.maximum(np.stack([np.array(c) for c in components], -1), 0)
    expected = brdf.eval(wi, wo)
    error = np.abs(values - expected) / np.maximum(expected, 0.01 * expected.mean())
    assert np.quantile(error, 0.999) < 2e-3


def in_numpy(formula, owner, a, b):
    with np.errstate(all="ignore"):
        return [np.stack(x, -1) if isinstance(x, tuple) else x for x in
                formula(owner, tuple(a.T), tuple(b.T))]  # fmt: skip


def test_compiled_code_gives_what_numpy_gives(brdf):
    wi, wo = awkward_pairs()
    u = np.random.default_rng(3).random(wi.shape, np.float32)
    above = wo[:, 2] > 0.01  # nearer to the horizon float32 does not resolve what a facet sees
    if brdf.traceable:
        (found,), (expected,) = (f(eval_formula, brdf, wi, wo) for f in (compiled_alone, in_numpy))
        rounding = np.abs(expected - brdf.eval(wi.astype(np.float64), wo.astype(np.float64)))
        limit = np.where(above, 5e-4, 2e-3)[:, None] * expected + 1e-3 + 4.0 * rounding
        np.testing.assert_array_less(np.abs(found - expected), limit)
        assert np.array_equal(brdf.eval(wi, wo), found)
        (found,), (expected,) = (f(_validity, brdf, wi, wo) for f in (compiled_alone, in_numpy))
        resolved = above | (wi[:, 2] > 0.01)
        assert (found == expected)[resolved].mean() > 0.998  # but where rounding chooses the cell
    (found,), (expected,) = (
        f(pdf_formula, brdf.sampler, wi, wo) for f in (compiled_alone, in_numpy)
    )
    np.testing.assert_array_less(np.abs(found - expected), 5e-4 * expected + 1e-5)
    (drawn, density), (directions, expected) = (
        f(sample_formula, brdf.sampler, wo, u) for f in (compiled_alone, in_numpy)
    )
    np.testing.assert_allclose(drawn[above], directions[above], atol=2e-4)
    close = np.abs(density - expected) <= 2e-3 * expected + 1e-4
    assert close[above].mean() > 0.995


def compiled_alone(formula, owner, a, b):
    names = ("wo", "u") if formula is sample_formula else ("wi", "wo")
    found = compiled(owner, formula, **dict(zip(names, (a, b), strict=True)))
    assert found is not None, "not compiled"
    return found


def test_bits_are_the_same_wherever_a_pair_stands(brdf, monkeypatch):
    wi, wo = awkward_pairs()
    u = np.random.default_rng(3).random(wi.shape, np.float32)
    asked = [lambda part: brdf.pdf(wi[part], wo[part]), lambda part: brdf.sample(wo[part], u[part])]
    asked += [lambda part: brdf.eval(wi[part], wo[part])] if brdf.traceable else []
    for ask in asked:
        whole = np.concatenate([x.reshape(len(wi), -1) for x in as_arrays(ask(slice(None)))], 1)
        for part in (slice(7, 8), slice(3, 20), slice(5, 1000), slice(None, None, -1)):
            found = as_arrays(ask(part))
            found = np.concatenate([x.reshape(len(wi[part]), -1) for x in found], 1)
            assert found.tobytes() == whole[part].tobytes()
        for cores, size in ((1, 16), (3, 500), (2, 999)):
            with monkeypatch.context() as patch:
                patch.setattr("nacre.runtime.parallel.core_count", lambda cores=cores: cores)
                patch.setattr("nacre.compile.vectorized._PARALLEL", 1)
                patch.setattr("nacre.compile.vectorized._SLICE", size)
                found = np.concatenate(
                    [x.reshape(len(wi), -1) for x in as_arrays(ask(slice(None)))], 1
                )
            assert found.tobytes() == whole.tobytes()


def as_arrays(found):
    return found if isinstance(found, tuple) else (found,)


def test_what_overflows_is_clamped():
    bright = NeuralBrdf([Layer(np.zeros((6, 3)), np.array([1.0, 90.0, 1e30]))])
    wi, wo = pairs(10)
    for dtype in (np.float32, np.float64):
        values = bright.eval(wi.astype(dtype), wo)
        assert values.dtype == dtype
        np.testing.assert_allclose(values[:, 0], math.e - 1.0, rtol=1e-6)
        assert (values[:, 2] == np.finfo(np.float32).max).all()


@dataclass
class Flat(Brdf):
    """A dataclass, whose constructor calls no other; the class has defaults of its own."""

    value: float
    name = "flat"
    sampler = UniformSampler()

    def eval_components(self, wi, wo):
        f = self.value + 0.0 * wi[2]
        return f, f, f


def test_a_subclass_needs_no_constructor_of_ours():
    made = Flat(0.2)
    other = made.replaced(name="other", source={"file": "x"})
    assert (made.name, made.source, made.sampler.kind) == ("flat", None, "uniform")
    assert (other.name, other.source, other.value) == ("other", {"file": "x"}, 0.2)
    with pytest.raises(AttributeError, match=r"use replaced\(value="):
        made.value = 0.3
    with pytest.raises(AttributeError, match="has no attribute 'titel'"):
        made.replaced(titel="x")
