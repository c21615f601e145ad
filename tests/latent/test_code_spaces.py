"""Codes in PyTorch and in Dr.Jit."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np
import pytest

from nacre.errors import NacreError
from tests.latent.made import basis, random_basis, random_hypernetwork
from tests.variants import by_precision, require_mitsuba

RANDOM = np.random.default_rng(5)
WI, WO = RANDOM.normal(size=(2, 50, 3)).astype(np.float32)
WI, WO = (w / np.linalg.norm(w, axis=1, keepdims=True) for w in (WI, WO))
CODES = RANDOM.normal(size=(3, 6))
STEP = 1e-3


def slopes(function):
    """Derivatives by the values of the first code, by differences."""
    rows = np.eye(6) * STEP
    return [(function(CODES[0] + r) - function(CODES[0] - r)) / (2 * STEP) for r in rows]


def total(code):
    """What the gradients of decoding are taken of."""
    return np.log(random_basis().decode(code).eval(WI, WO)[SEEN].astype(float)).sum()


SEEN = (WI[:, 2] > 0.0) & (WO[:, 2] > 0.0)


@pytest.fixture
def in_torch() -> tuple[ModuleType, Any]:
    """PyTorch, and the codes of a basis there."""
    torch = pytest.importorskip("torch", reason="needs the extra 'torch'")
    from nacre.latent.torch import CodeSpace

    return torch, CodeSpace(random_basis())


@pytest.fixture
def in_drjit() -> tuple[ModuleType, Any]:
    """Mitsuba, and the codes of a basis in its Dr.Jit."""
    mi = require_mitsuba()
    from nacre.latent.drjit import CodeSpace

    return mi, CodeSpace(random_basis())


def test_torch_decodes_as_the_basis_does(in_torch):
    torch, space = in_torch
    codes, wi, wo = (torch.from_numpy(a) for a in (CODES.astype(np.float32), WI, WO))
    found = space.decode(codes[:, None], wi, wo)
    expected = [random_basis().decode(code).eval(WI, WO) for code in CODES]
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-7)
    each = space.decode(codes, wi[:3], wo[:3])
    np.testing.assert_array_equal(each, found[range(3), range(3)])


def test_torch_gradients_are_those_of_differences(in_torch):
    torch, space = in_torch
    code = torch.tensor(CODES[0], requires_grad=True)
    seen = torch.from_numpy(SEEN)
    space.decode(code, torch.from_numpy(WI), torch.from_numpy(WO))[seen].log().sum().backward()
    np.testing.assert_allclose(code.grad, slopes(total), rtol=1e-3, atol=0.05)
    wi = torch.tensor(WI[SEEN].astype(float), requires_grad=True)
    wo = torch.from_numpy(WO[SEEN].astype(float))
    assert torch.autograd.gradcheck(lambda w: space.decode(code.detach(), w, wo), wi)


def test_torch_the_prior_is_numpys(in_torch):
    torch, space = in_torch
    code = torch.tensor(CODES, requires_grad=True)
    logs = space.log_prior(code)
    np.testing.assert_allclose(logs.detach(), random_basis().prior.log_density(CODES))
    logs.sum().backward()
    np.testing.assert_allclose(code.grad, random_basis().prior.slope(CODES), rtol=1e-6)


def test_torch_other_bases_are_refused(in_torch):
    from nacre.latent.torch import CodeSpace

    for other in (basis(), random_hypernetwork()):
        with pytest.raises(NacreError, match="expected a neural basis"):
            CodeSpace(other)


def test_drjit_decodes_as_the_basis_does(in_drjit):
    mi, space = in_drjit
    wi, wo = (mi.Vector3f(w.T) for w in (WI, WO))
    expected = random_basis().decode(CODES[0]).eval(WI, WO)
    for code in (mi.Float(CODES[0]), [mi.Float(v) for v in CODES[0]]):
        found = np.array(space.decode(code, wi, wo)).T
        np.testing.assert_allclose(found, expected, rtol=by_precision(1e-4), atol=1e-7)
    several = [mi.Float(v) for v in CODES.T]
    found = np.array(space.decode(several, mi.Vector3f(WI[:3].T), mi.Vector3f(WO[:3].T))).T
    each = [random_basis().decode(c).eval(*w) for c, *w in zip(CODES, WI[:3], WO[:3], strict=True)]
    np.testing.assert_allclose(found, each, rtol=by_precision(1e-4), atol=1e-7)


def test_drjit_gradients_are_those_of_differences_and_nothing_is_compiled_again(in_drjit):
    mi, space = in_drjit
    import drjit as dr

    wi, wo = (mi.Vector3f(w[SEEN].T) for w in (WI, WO))

    def gradient(values):
        code = mi.Float(values)
        dr.enable_grad(code)
        logs = sum(dr.log(c) for c in space.decode(code, wi, wo))
        dr.backward(dr.sum(logs))
        return np.array(dr.grad(code))

    np.testing.assert_allclose(gradient(CODES[0]), slopes(total), rtol=1e-3, atol=0.05)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory):
        dr.kernel_history_clear()
        gradient(CODES[1])
        history = dr.kernel_history([dr.KernelType.JIT])
    assert history
    assert all(kernel["cache_hit"] for kernel in history)


def test_drjit_the_prior_is_numpys(in_drjit):
    mi, space = in_drjit
    import drjit as dr

    prior = random_basis().prior
    code = [mi.Float(v) for v in CODES.T]
    dr.enable_grad(code)
    logs = space.log_prior(code)
    np.testing.assert_allclose(logs, prior.log_density(CODES), rtol=1e-5)
    dr.backward(logs)
    np.testing.assert_allclose(
        np.stack([dr.grad(v) for v in code], axis=-1), prior.slope(CODES), rtol=1e-4, atol=1e-5
    )
    one = mi.Float(CODES[0])
    dr.enable_grad(one)
    dr.set_grad(one, mi.Float(CODES[1]))
    change = dr.forward_to(space.log_prior(one), flags=dr.ADFlag.Default)
    expected = prior.slope(CODES[0]) @ CODES[1]
    np.testing.assert_allclose(change, expected, rtol=1e-4)


def test_drjit_what_is_no_code_is_refused(in_drjit):
    mi, space = in_drjit
    from nacre.latent.drjit import CodeSpace

    with pytest.raises(ValueError, match="6 values, got 5"):
        space.log_prior(mi.Float([0.0] * 5))
    with pytest.raises(NacreError, match="expected a neural basis"):
        CodeSpace(basis())
