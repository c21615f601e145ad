"""What every reflectance in the package promises, on every one of them."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass

import numpy as np
import pytest

from nacre.analytic.model import AnalyticBrdf
from nacre.brdf import Brdf, CosineSampler, _validity, eval_formula, pdf_formula, sample_formula
from nacre.compile.pairs import compiled
from nacre.errors import NacreError
from nacre.mitsuba import bsdf
from nacre.neural import Layer, NeuralBrdf
from nacre.sampling import UniformSampler, check_isotropic
from tests.contracts.classes import concrete
from tests.contracts.directions import awkward_pairs, extreme_directions, pairs, views
from tests.contracts.materials import FEW, MATERIALS, made
from tests.measured.support import relative_error
from tests.tiers import tiered
from tests.variants import require_mitsuba


@pytest.fixture(scope="module", params=tiered(MATERIALS, FEW))
def brdf(request: pytest.FixtureRequest) -> Brdf:
    return made(request.param)


def test_every_kind_is_here():
    kinds = {type(made(name)) for name in MATERIALS if "." not in name}
    left = {kind.__name__ for kind in concrete(Brdf) - kinds}
    assert left == {"MitsubaBrdf"}  # a window onto Mitsuba


def test_values_are_finite_non_negative_colors(brdf):
    wi, wo = pairs()
    values = brdf.eval(wi, wo)
    assert values.shape == (4000, 3)
    assert values.dtype == np.float32
    assert np.isfinite(values).all()
    assert (values >= 0).all()
    assert values.max() > 0
    assert brdf.eval(wi.astype(np.float64), wo).dtype == np.float64
    raw = brdf.eval_components(tuple(wi.T), tuple(wo.T))
    assert all(component.dtype == np.float32 for component in raw)


def test_spectra_are_finite_and_non_negative(brdf):
    wi, wo = pairs()
    if brdf.wavelengths is None:
        with pytest.raises(NacreError, match="RGB only"):
            brdf.eval_spectral(wi, wo)
        return
    spectra = brdf.eval_spectral(wi[:500], wo[:500])
    assert spectra.shape == (500, len(brdf.wavelengths))
    assert np.isfinite(spectra).all()
    assert (spectra >= 0).all()
    assert (np.diff(brdf.wavelengths) > 0).all()
    assert (brdf.eval_spectral(wi[:5] * [1, 1, -1], wo[:5]) == 0).all()
    facts = brdf.describe()
    assert facts["bands"] == len(brdf.wavelengths)


def test_shapes_broadcast_down_to_one_direction(brdf):
    wi, wo = pairs()
    grid = brdf.eval(wi[:5, None], wo[None, :7])
    assert grid.shape == (5, 7, 3)
    one = brdf.eval(wi[2], wo[3])
    assert one.shape == (3,)
    np.testing.assert_allclose(one, grid[2, 3], rtol=1e-4, atol=1e-6)
    assert brdf.pdf(wi[2], wo[3]).shape == ()
    assert brdf.valid(wi[2], wo[3]).shape == ()
    assert brdf.sample(wo[3], np.full(3, 0.5))[0].shape == (3,)
    assert brdf.eval(np.zeros((0, 3)), np.zeros((0, 3))).shape == (0, 3)


def test_nothing_is_reflected_at_or_below_the_horizon(brdf):
    wi, wo = (w[:100].copy() for w in pairs())
    level = wi * [1, 1, 0]
    for below in (-wi, level / np.linalg.norm(level, axis=1, keepdims=True)):
        assert (brdf.eval(below, wo) == 0).all()
        assert (brdf.eval(wo, below) == 0).all()
        assert (brdf.pdf(below, wo) == 0).all()
        assert (brdf.pdf(wo, below) == 0).all()
        assert not brdf.valid(below, wo).any()
        assert (brdf.sample(below, np.full((100, 3), 0.3))[1] == 0).all()


def test_isotropy_is_what_it_says(brdf):
    wi, wo = pairs(500)
    c, s = math.cos(1.0), math.sin(1.0)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]], np.float32)
    one, turned = brdf.eval(wi, wo), brdf.eval(wi @ turn.T, wo @ turn.T)
    close = np.isclose(one, turned, rtol=1e-2, atol=1e-3).all(axis=1).mean()
    assert (close > 0.99) == brdf.isotropic


def test_tensors_give_the_same_numbers_and_their_slope(brdf):
    torch = pytest.importorskip("torch", reason="needs the extra 'torch'")
    wi, wo = (w[:300].astype(np.float64) for w in pairs())
    light, view = torch.tensor(wi, requires_grad=True), torch.tensor(wo)
    expected = brdf.eval(wi, wo)
    with torch.no_grad():
        np.testing.assert_array_equal(brdf.eval(light, view).numpy(), expected)
    if not brdf.traceable:
        with pytest.raises(NacreError, match="takes NumPy arrays only"):
            brdf.eval(light, view)
        return
    values = brdf.eval(light, view)
    np.testing.assert_allclose(values.detach().numpy(), expected, rtol=1e-9, atol=1e-12)
    values.sum().backward()
    across = np.cross(wi, [0.48, 0.6, 0.64])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    step = 1e-6
    ends = [brdf.eval(math.cos(step) * wi + side * across, wo) for side in (step, -step)]
    slope = ((ends[0] - ends[1]) / (2 * step)).sum(axis=1)
    ours = (light.grad.numpy() * across).sum(axis=1)
    close = np.isclose(ours, slope, rtol=1e-3, atol=1e-4 * expected.max())
    assert close.mean() > 0.97  # not in steps across edges of tables


def test_sample_and_pdf_agree(brdf):
    u = np.random.default_rng(1).random((4, 1500, 3), np.float32)
    wo = np.broadcast_to(views(4)[:, None], u.shape)
    wi, density = brdf.sample(wo, u)
    drawn = density > 0
    assert drawn.mean() > 0.4
    np.testing.assert_allclose(np.linalg.norm(wi[drawn], axis=1), 1.0, atol=2e-4)
    again = brdf.pdf(wi[drawn], wo[drawn])
    assert np.quantile(np.abs(again / density[drawn] - 1.0), 0.99) < 0.02


@pytest.mark.parametrize("double", [False, True])
def test_extremes_give_numbers(brdf, double):
    """At the pole, at the horizon and next to it, mirrored and opposite to the last bit."""
    w = extreme_directions().astype(np.float64 if double else np.float32)
    w = w if brdf.traceable else w[::5]
    values = brdf.eval(w[:, None], w)
    assert np.isfinite(values).all()
    assert (values >= 0).all()
    hidden = w[:, 2] <= 0
    assert (values[hidden] == 0).all()
    assert (values[:, hidden] == 0).all()
    assert not brdf.valid(w[:, None], w)[hidden].any()


def test_single_precision_is_enough(brdf):
    wi, wo = (w[:1500] for w in pairs())
    single, double = brdf.eval(wi, wo), brdf.eval(wi.astype(np.float64), wo)
    share = 1.0 if isinstance(brdf, AnalyticBrdf) else 0.99  # rounding chooses cells of tables
    assert np.quantile(relative_error(single, double), share) < 2e-3


def test_facts_can_be_shown_and_stored(brdf):
    facts = brdf.describe()
    assert facts["model"] == type(brdf).__name__
    assert facts["isotropic"] == brdf.isotropic
    json.dumps(facts)


def test_a_sampler_can_be_replaced(brdf):
    wo, up = np.array([0.0, 0.6, 0.8], np.float32), np.array([0.0, 0.0, 1.0])
    before = brdf.pdf(up, wo)
    other = brdf.replaced(sampler=CosineSampler(), name="other", source={"file": "a"})
    assert other.pdf(up, wo) == pytest.approx(1 / math.pi)
    assert (other.name, other.source) == ("other", {"file": "a"})
    assert brdf.pdf(up, wo) == before


def test_shown_in_one_line_and_as_a_table(brdf):
    shown = repr(brdf)
    assert shown.startswith(f"<{type(brdf).__name__} {brdf.name!r}: ")
    assert len(shown.splitlines()) == 1
    assert len(shown) < 200
    table = brdf._repr_html_()
    assert table.count("<tr>") == len(brdf.describe())


def test_isotropy_is_what_it_is_said_to_be(brdf):
    check_isotropic(brdf)


@pytest.mark.parametrize("bad", [(0.0, 0.0, 1.002), (0.0, 0.0, 0.0), (math.nan, 0.0, 1.0)])
def test_directions_that_are_no_unit_vectors_are_refused(brdf, bad):
    wi, wo = (w[:1000].copy() for w in pairs())
    wi[[1, 5]] = bad
    message = r"wi: 2 of 1000 directions are not of unit length \(the worst is "
    for ask in (brdf.eval, brdf.valid, brdf.pdf):
        with pytest.raises(ValueError, match=message):
            ask(wi, wo)
        with pytest.raises(ValueError, match=r"wo: 1 of 1 directions"):
            ask(wo, bad)
    with pytest.raises(ValueError, match=r"wo: 2 of 1000 directions"):
        brdf.sample(wi, np.full(3, 0.5, np.float32))
    if brdf.wavelengths is not None:
        with pytest.raises(ValueError, match=message):
            brdf.eval_spectral(wi, wo)


def test_directions_that_rounding_leaves_are_taken(brdf):
    wi, wo = (w[:100].astype(np.float64) for w in pairs())
    np.testing.assert_allclose(
        brdf.eval(wi * 1.0005, wo).mean(), brdf.eval(wi, wo).mean(), rtol=0.2
    )


def test_numbers_that_were_rounded_to_one_are_taken(brdf):
    u = np.full((4, 3), np.float32(1.0 - 1e-9))
    assert u.max() == 1.0
    wo = np.tile(np.array([0.0, 0.6, 0.8], np.float32), (4, 1))
    for part in brdf.sample(wo, u):
        assert np.isfinite(part).all()


@pytest.mark.parametrize("bad", [1.001, -1e-3, math.nan, math.inf])
def test_numbers_out_of_range_are_refused(brdf, bad):
    u = np.full((10, 3), 0.5)
    u[3, 1] = bad
    with pytest.raises(ValueError, match=r"u: 1 of 30 numbers are not in \[0, 1\) \(the worst is"):
        brdf.sample((0.0, 0.6, 0.8), u)


def test_attributes_stay(brdf):
    for name in ("sampler", "name", "source", "isotropic"):
        with pytest.raises(AttributeError, match=rf"use replaced\({name}="):
            setattr(brdf, name, None)


def test_wrong_shapes_are_refused(brdf):
    with pytest.raises(ValueError, match=r"\(\.\.\., 3\)"):
        brdf.eval(np.zeros((4, 2)), np.zeros((4, 3)))


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
