"""Jets against automatic differentiation."""

from __future__ import annotations

import pytest

from nacre_lab.benchmark.peers.jets import ALL, Jet

torch = pytest.importorskip("torch", reason="needs the extra 'torch'")

POINT = 0.3, 0.7, 1.1


def test_derivatives_are_those_of_automatic_differentiation() -> None:
    values = [torch.tensor(x, dtype=torch.float64, requires_grad=True) for x in POINT]
    a, b, c = values
    expected = torch.exp(torch.sin(a * b + c) * (a * a + 2.0) + b * c)
    one, two, three = (
        Jet.variable(x.detach(), bit) for x, bit in zip(values, (1, 2, 4), strict=True)
    )
    inner = one * two + three
    s, k = torch.sin(inner.parts[0]), torch.cos(inner.parts[0])
    exponent = inner.through((s, k, -s, -k)) * (one * one + 2.0) + two * three
    found = exponent.through([torch.exp(exponent.parts[0])] * 4)
    for key in ALL:
        value = expected
        for bit, variable in zip((1, 2, 4), values, strict=True):
            if key & bit:
                (value,) = torch.autograd.grad(value, variable, create_graph=True)
        torch.testing.assert_close(found.parts[key], value.detach(), rtol=1e-12, atol=1e-12)
