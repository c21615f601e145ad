"""JAX arrays against NumPy and against PyTorch's gradients."""

from __future__ import annotations

import numpy as np
import pytest

from nacre.neural.inputs import ENHANCED
from tests.contracts.directions import pairs
from tests.contracts.materials import made
from tests.tiers import tiered

jax = pytest.importorskip("jax", reason="needs the extra 'jax'")

NAMES = [f"isotropic network of {ENHANCED} inputs", "MERL table of a network"]


@pytest.fixture(scope="module", params=tiered(NAMES, NAMES[:1]))
def brdf(request):
    return made(request.param)


SPECIAL = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])


def test_compiled_values_and_gradients_are_those_of_numpy_and_pytorch(brdf):
    torch = pytest.importorskip("torch", reason="needs the extra 'torch'")
    known = [w[:200] for w in pairs()]
    at_edges = (w.reshape(-1, 3) for w in np.broadcast_arrays(SPECIAL[:, None], SPECIAL))
    wi, wo = (np.concatenate([*w], dtype=np.float32) for w in zip(known, at_edges, strict=True))

    def total(wi, wo):
        values = brdf.eval(wi, wo)
        return values.sum(), values

    slope, values = jax.jit(jax.grad(total, has_aux=True))(wi, wo)
    np.testing.assert_allclose(values, brdf.eval(wi, wo), rtol=2e-3, atol=2e-4)
    light = torch.tensor(wi, requires_grad=True)
    brdf.eval(light, wo).sum().backward()
    theirs = light.grad.numpy()[:200]  # at edges there may be more than one
    scale = np.abs(theirs).max()
    np.testing.assert_allclose(slope[:200], theirs, rtol=2e-2, atol=1e-3 * scale)
    assert np.isfinite(slope).all()
    assert (slope[-4:] == 0).all()


def test_arrays_of_jax_give_arrays_of_jax(brdf):
    wi, wo = (jax.numpy.asarray(w[:50]) for w in pairs())
    values = brdf.eval(wi[:, None], wo)
    assert isinstance(values, jax.Array)
    expected = brdf.eval(np.asarray(wi)[:, None], np.asarray(wo))
    rounding = 0.0 if jax.default_backend() == "cpu" else 1e-5
    np.testing.assert_allclose(values, expected, rtol=rounding, atol=rounding)
    if jax.default_backend() == "cpu":  # where lengths are checked
        with pytest.raises(ValueError, match="not of unit length"):
            brdf.eval(2.0 * wi, wo)
    with pytest.raises(ValueError, match=r"expected wo of shape \(..., 3\), got \(50, 2\)"):
        jax.jit(brdf.eval)(wi, wo[:, :2])
