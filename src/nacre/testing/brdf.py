"""What every reflectance keeps."""

from __future__ import annotations

import functools
import importlib.util
import json
import math
import unittest
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from nacre.analytic import AnalyticBrdf
from nacre.brdf import Brdf, CosineSampler
from nacre.errors import NacreError
from nacre.sampling import check_isotropic
from nacre.soundness import PROPERTIES, Plan, check, subject
from nacre.testing.cases import Checks, Contracts, maker, pairs, refused, relative_error, under
from nacre.testing.extremes import extreme_directions, views

CONTRACTS = Contracts()


def check_brdf(
    brdf: Brdf | Callable[[], Brdf],
    *,
    properties: Iterable[str] = tuple(PROPERTIES),
    samples: int = 1 << 15,
) -> Checks:
    """Contracts of a reflectance.

    Values are finite colors that broadcast, nothing is reflected below the horizon, precisions and
    libraries agree, errors name what is wrong; and the properties of `nacre check`.

    Parameters
    ----------
    brdf
        A reflectance, or a function that makes it.
    properties
        Which of :data:`nacre.soundness.PROPERTIES` to check too, as "soundness: energy" and so on.
    samples
        See :class:`nacre.soundness.Plan`.
    """
    made = functools.cache(maker(brdf, Brdf))
    yield from CONTRACTS.of(made)
    yield from under(
        "soundness",
        ((name, functools.partial(_sound, made, name, samples)) for name in properties),
    )


def _sound(made: Callable[[], Brdf], name: str, samples: int) -> None:
    (found,) = check(subject(made()), Plan(samples), [name]).results
    if found.state == "not applicable":
        raise unittest.SkipTest(found.sentence)
    where = "" if found.where is None else f" Worst at {found.where}."
    assert found.state != "failed", f"{found.sentence}{where}"


@CONTRACTS.add
def _values_are_finite_and_non_negative_colors(brdf: Brdf) -> None:
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


@CONTRACTS.add
def _spectra_are_finite_and_non_negative(brdf: Brdf) -> None:
    wi, wo = pairs()
    if brdf.wavelengths is None:
        refused(NacreError, brdf.eval_spectral, wi, wo, words="RGB only")
        return
    spectra = brdf.eval_spectral(wi[:500], wo[:500])
    assert spectra.shape == (500, len(brdf.wavelengths))
    assert np.isfinite(spectra).all()
    assert (spectra >= 0).all()
    assert (np.diff(brdf.wavelengths) > 0).all()
    assert (brdf.eval_spectral(wi[:5] * [1, 1, -1], wo[:5]) == 0).all()
    assert brdf.describe()["bands"] == len(brdf.wavelengths)


@CONTRACTS.add
def _shapes_broadcast_down_to_one_direction(brdf: Brdf) -> None:
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


@CONTRACTS.add
def _nothing_is_reflected_at_or_below_the_horizon(brdf: Brdf) -> None:
    wi, wo = (w[:100].copy() for w in pairs())
    level = wi * [1, 1, 0]
    for below in (-wi, level / np.linalg.norm(level, axis=1, keepdims=True)):
        assert (brdf.eval(below, wo) == 0).all()
        assert (brdf.eval(wo, below) == 0).all()
        assert (brdf.pdf(below, wo) == 0).all()
        assert (brdf.pdf(wo, below) == 0).all()
        assert not brdf.valid(below, wo).any()
        assert (brdf.sample(below, np.full((100, 3), 0.3))[1] == 0).all()


@CONTRACTS.add
def _isotropy_is_what_it_says(brdf: Brdf) -> None:
    check_isotropic(brdf)
    wi, wo = pairs(500)
    c, s = math.cos(1.0), math.sin(1.0)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]], np.float32)
    one, turned = brdf.eval(wi, wo), brdf.eval(wi @ turn.T, wo @ turn.T)
    close = np.isclose(one, turned, rtol=1e-2, atol=1e-3).all(axis=1).mean()
    assert (close > 0.99) == brdf.isotropic


@CONTRACTS.add
def _tensors_give_the_same_numbers_and_their_slope(brdf: Brdf) -> None:
    if importlib.util.find_spec("torch") is None:
        raise unittest.SkipTest("needs PyTorch")
    import torch

    wi, wo = (w[:300].astype(np.float64) for w in pairs())
    light: Any = torch.tensor(wi, requires_grad=True)
    view: Any = torch.tensor(wo)
    expected = brdf.eval(wi, wo)
    with torch.no_grad():
        plain: Any = brdf.eval(light, view)
        np.testing.assert_array_equal(plain.numpy(), expected)
    if not brdf.traceable:
        refused(NacreError, brdf.eval, light, view, words="takes NumPy arrays only")
        return
    values: Any = brdf.eval(light, view)
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


@CONTRACTS.add
def _samples_have_the_density_of_pdf(brdf: Brdf) -> None:
    u = np.random.default_rng(1).random((4, 1500, 3), np.float32)
    wo = np.broadcast_to(views(4)[:, None], u.shape)
    wi, density = brdf.sample(wo, u)
    drawn = density > 0
    assert drawn.mean() > 0.4
    np.testing.assert_allclose(np.linalg.norm(wi[drawn], axis=1), 1.0, atol=2e-4)
    again = brdf.pdf(wi[drawn], wo[drawn])
    assert np.quantile(np.abs(again / density[drawn] - 1.0), 0.99) < 0.02


@CONTRACTS.add
def _extremes_give_numbers(brdf: Brdf) -> None:
    for kind in (np.float32, np.float64):
        w: Any = extreme_directions().astype(kind)
        w = w if brdf.traceable else w[::5]
        values = brdf.eval(w[:, None], w)
        assert np.isfinite(values).all()
        assert (values >= 0).all()
        hidden = w[:, 2] <= 0
        assert (values[hidden] == 0).all()
        assert (values[:, hidden] == 0).all()
        assert not brdf.valid(w[:, None], w)[hidden].any()


@CONTRACTS.add
def _single_precision_is_enough(brdf: Brdf) -> None:
    wi, wo = (w[:1500] for w in pairs())
    single, double = brdf.eval(wi, wo), brdf.eval(wi.astype(np.float64), wo)
    share = 1.0 if isinstance(brdf, AnalyticBrdf) else 0.99  # rounding chooses cells of tables
    assert np.quantile(relative_error(single, double), share) < 2e-3


@CONTRACTS.add
def _facts_can_be_shown_and_stored(brdf: Brdf) -> None:
    facts = brdf.describe()
    assert facts["model"] == type(brdf).__name__
    assert facts["isotropic"] == brdf.isotropic
    json.dumps(facts)
    shown = repr(brdf)
    assert shown.startswith(f"<{type(brdf).__name__} {brdf.name!r}: ")
    assert len(shown.splitlines()) == 1
    assert len(shown) < 200
    assert brdf._repr_html_().count("<tr>") == len(facts)


@CONTRACTS.add
def _a_sampler_can_be_replaced(brdf: Brdf) -> None:
    wo, up = np.array([0.0, 0.6, 0.8], np.float32), np.array([0.0, 0.0, 1.0])
    before = brdf.pdf(up, wo)
    other = brdf.replaced(sampler=CosineSampler(), name="other", source={"file": "a"})
    np.testing.assert_allclose(other.pdf(up, wo), 1 / math.pi, rtol=1e-6)
    assert (other.name, other.source) == ("other", {"file": "a"})
    assert brdf.pdf(up, wo) == before
    for name in ("sampler", "name", "source", "isotropic"):
        refused(AttributeError, setattr, brdf, name, None, words=rf"use replaced\({name}=")


@CONTRACTS.add
def _directions_that_are_no_unit_vectors_are_refused(brdf: Brdf) -> None:
    for bad in ((0.0, 0.0, 1.002), (0.0, 0.0, 0.0), (math.nan, 0.0, 1.0)):
        wi, wo = (w[:1000].copy() for w in pairs())
        wi[[1, 5]] = bad
        message = r"wi: 2 of 1000 directions are not of unit length \(the worst is "
        for ask in (brdf.eval, brdf.valid, brdf.pdf):
            refused(ValueError, ask, wi, wo, words=message)
            refused(ValueError, ask, wo, bad, words="wo: 1 of 1 directions")
        half = np.full(3, 0.5, np.float32)
        refused(ValueError, brdf.sample, wi, half, words="wo: 2 of 1000 directions")
        if brdf.wavelengths is not None:
            refused(ValueError, brdf.eval_spectral, wi, wo, words=message)
    refused(ValueError, brdf.eval, np.zeros((4, 2)), np.zeros((4, 3)), words=r"\(\.\.\., 3\)")


@CONTRACTS.add
def _what_rounding_leaves_is_taken(brdf: Brdf) -> None:
    wi, wo = (w[:100].astype(np.float64) for w in pairs())
    near = brdf.eval(wi * 1.0005, wo).mean()
    np.testing.assert_allclose(near, brdf.eval(wi, wo).mean(), rtol=0.2)
    one = np.full((4, 3), np.float32(1.0 - 1e-9))
    for part in brdf.sample(np.tile(np.array([0.0, 0.6, 0.8], np.float32), (4, 1)), one):
        assert np.isfinite(part).all()


@CONTRACTS.add
def _numbers_out_of_range_are_refused(brdf: Brdf) -> None:
    message = r"u: 1 of 30 numbers are not in \[0, 1\) \(the worst is"
    for bad in (1.001, -1e-3, math.nan, math.inf):
        u = np.full((10, 3), 0.5)
        u[3, 1] = bad
        refused(ValueError, brdf.sample, (0.0, 0.6, 0.8), u, words=message)
