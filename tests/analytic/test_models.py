"""Every analytic model: one formula on three libraries, its samples, its symmetries."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nacre.analytic import MODELS
from nacre.analytic.factor import FactoredBrdf
from nacre.analytic.fresnel import dielectric
from nacre.analytic.model import TableParameter
from nacre.brdf import above_horizon
from nacre.geometry import split
from nacre.mitsuba import bsdf
from tests.analytic.materials import EXAMPLES
from tests.measured.support import hemisphere
from tests.mitsuba.chi_square import chi_square
from tests.mitsuba.reflectances import interaction
from tests.variants import require_mitsuba


def pairs(count=2000, seed=0):
    random = np.random.default_rng(seed)
    return tuple(hemisphere(random, count).astype(np.float64) for _ in range(2))


@pytest.fixture(params=MODELS)
def brdf(request):
    return EXAMPLES[request.param]


@pytest.fixture(params=[name for name, model in MODELS.items() if model.fitted_on == "samples"])
def simple(request):
    """Not of a renderer's layers, which may see the viewer's angle only, and colors of others."""
    return EXAMPLES[request.param]


def test_exchanging_the_directions_changes_nothing(simple):
    wi, wo = pairs()  # unit vectors to single precision
    np.testing.assert_allclose(simple.eval(wi, wo), simple.eval(wo, wi), rtol=1e-5)


def test_pytorch_gives_what_numpy_gives_and_its_derivatives(brdf):
    torch = pytest.importorskip("torch", reason="needs the extra 'latent'")
    wi, wo = pairs(200)
    light, view = (tuple(torch.from_numpy(np.ascontiguousarray(c)) for c in w.T) for w in (wi, wo))
    leaves = {
        name: tuple(torch.tensor(v, dtype=torch.float64, requires_grad=True) for v in value)
        if isinstance(value, tuple)
        else torch.tensor(value, dtype=torch.float64, requires_grad=True)
        for name, value in ((p.name, brdf.values[p.name]) for p in brdf.parameters)
    }
    rgb = torch.stack(brdf.formula({**brdf.operands, **leaves}, light, view), -1)
    np.testing.assert_allclose(rgb.detach().numpy(), brdf.eval(wi, wo), rtol=3e-7)
    total = rgb.sum()
    for name, value in leaves.items():
        for channel, leaf in enumerate(value if isinstance(value, tuple) else (value,)):
            derivative = float(torch.autograd.grad(total, leaf, retain_graph=True)[0])

            def moved(step, name=name, channel=channel):
                changed = {**brdf.operands, **leaves}
                old = changed[name]
                if isinstance(old, tuple):
                    new = list(old)
                    new[channel] = new[channel] + step
                    changed[name] = tuple(new)
                else:
                    changed[name] = old + step
                return float(sum(c.detach().sum() for c in brdf.formula(changed, light, view)))

            step = 1e-6 * max(1e-2, abs(float(leaf.detach())))
            expected = (moved(step) - moved(-step)) / (2 * step)
            assert derivative == pytest.approx(expected, rel=1e-4, abs=1e-5 * float(total.detach()))


# Mitsuba's own test, of each kind of sampler that models have.
CHI_SQUARE = [("lambert", 60.0), ("sgd", 60.0), *(("ggx", d) for d in (0.0, 60.0, 85.0))]
CHI_SQUARE += [("ggx-anisotropic", d) for d in (0.0, 60.0, 85.0)]


@pytest.mark.parametrize(("name", "degrees"), CHI_SQUARE)
def test_samples_follow_the_density(name, degrees):
    mi = require_mitsuba()
    test = chi_square(mi, bsdf(EXAMPLES[name]), degrees)
    assert test.run(test_count=len(CHI_SQUARE), quiet=True), test.messages


def test_the_channels_of_a_color_do_not_mix(simple):
    wi, wo = pairs(50)
    before = simple.eval(wi, wo)
    for parameter in simple.parameters:
        if parameter.color:
            red, green, blue = simple.values[parameter.name]
            other = type(simple)(**simple.values | {parameter.name: (red, 0.99 * green, blue)})
            after = other.eval(wi, wo)
            np.testing.assert_array_equal(after[:, [0, 2]], before[:, [0, 2]])
            assert (after[:, 1] != before[:, 1]).any()


def test_free_numbers_and_bounded_ones_are_the_same(brdf):
    if isinstance(brdf, FactoredBrdf):
        pytest.skip("no fit searches its numbers")
    for parameter in brdf.parameters:
        middle = parameter.at(np.array([0.01, 0.5, 0.99]))
        np.testing.assert_allclose(
            parameter.from_free(parameter.to_free(middle)), middle, rtol=1e-4
        )
        ends = parameter.from_free(np.array([-40.0, 40.0]))
        width = parameter.high - parameter.low
        np.testing.assert_allclose(ends, [parameter.low, parameter.high], atol=1e-12 * width)


def extreme(parameter, share, random):
    """Values at a share of the way between the bounds; those of a table here and there."""
    if isinstance(parameter, TableParameter):
        chosen = random.random((parameter.rows, parameter.nodes)) < 0.5
        width = parameter.high - parameter.low
        return np.where(chosen, parameter.low + share * width, parameter.low)
    low, high = parameter.low, parameter.high
    return np.broadcast_to(min(low + (high - low) * share, high), (3,) * parameter.color)


@pytest.mark.parametrize("model", MODELS)
def test_bounds_give_numbers_of_single_precision(model):
    random = np.random.default_rng(4)
    wi, wo = (hemisphere(random, 200) for _ in range(2))
    wi[0], wo[:2] = (0.0, 0.0, 1.0), (0.0, 0.0, 1.0)
    wi[2:40] *= (1.0, 1.0, 1e-4)
    wi = (wi / np.linalg.norm(wi, axis=1, keepdims=True)).astype(np.float32)
    for _ in range(100):
        shares = [random.choice((0.0, 1e-9, 1e-3, 1.0)) for _ in MODELS[model].numbers()]
        values = {
            p.name: extreme(p, share, random)
            for p, share in zip(MODELS[model].numbers(), shares, strict=True)
        }
        brdf, light, view = MODELS[model](**values), split(wi), split(wo)
        # By NumPy, in single precision: to compile a material takes a hundred times as long.
        with np.errstate(all="ignore"):
            f_r = above_horizon(brdf.eval_components(light, view), light, view)
        assert np.isfinite(f_r).all(), values


def test_parameters_are_checked():
    kind = MODELS["ggx"]
    good = EXAMPLES["ggx"].values
    with pytest.raises(ValueError, match="roughness must lie in"):
        kind(**good | {"roughness": 2.0})
    with pytest.raises(ValueError, match="diffuse must lie in"):
        kind(**good | {"diffuse": (0.1, math.nan, 0.1)})
    with pytest.raises(ValueError, match="three numbers"):
        kind(**good | {"diffuse": 0.5})
    with pytest.raises(ValueError, match=r"^ggx lacks specular, roughness$"):
        kind(diffuse=(0, 0, 0))
    with pytest.raises(ValueError, match=r"^ggx lacks roughness and has no gloss$"):
        kind(diffuse=(0, 0, 0), specular=(0, 0, 0), gloss=0.5)
    for wrong in ("0.5", True, None, {}):
        with pytest.raises(ValueError, match="roughness takes numbers"):
            kind(**good | {"roughness": wrong})


def test_a_lobe_of_no_direction_gives_numbers():
    nowhere = {**EXAMPLES["lafortune"].values, "c_xy": 0.0, "c_z": 0.0}
    assert np.isfinite(MODELS["lafortune"](**nowhere).eval(*pairs(50))).all()


@pytest.mark.parametrize("index", [1.3, 1.5, 3.0])
def test_the_dielectric_is_mitsubas(index):
    mi = require_mitsuba()
    cosine = np.linspace(0.01, 1, 100)
    expected = np.array(mi.fresnel(mi.Float(cosine), index)[0])
    np.testing.assert_allclose(dielectric(cosine, index), expected, atol=1e-5)


@pytest.mark.parametrize("roughness", [0.1, 0.4])
def test_schlick_cook_torrance_has_mitsubas_beckmann_facets(roughness):
    """At normal incidence nothing is masked: what is left is D F / (pi cos), D of Beckmann."""
    mi = require_mitsuba()
    options = {"type": "roughconductor", "material": "none", "distribution": "beckmann"}
    bsdf = mi.load_dict(options | {"alpha": roughness, "sample_visible": False})
    wi = pairs(500)[0].astype(np.float32)
    wi = wi[wi[:, 2] > 0.9]
    wo = np.tile(np.array([0, 0, 1], np.float32), (len(wi), 1))
    light = mi.Vector3f(np.ascontiguousarray(wi.T))
    density = np.array(bsdf.pdf(mi.BSDFContext(), interaction(mi, wo), light))
    d = 4 * density  # the density of wi is D cos(theta_h) / (4 wo.h), and wo is the normal
    brdf = MODELS["cook-torrance-schlick"](
        diffuse=(0, 0, 0), specular=(1, 1, 1), roughness=roughness, normal_reflectance=1.0
    )
    expected = d / (math.pi * wi[:, 2])
    np.testing.assert_allclose(brdf.eval(wi, wo)[:, 1], expected, rtol=2e-3, atol=1e-5)
