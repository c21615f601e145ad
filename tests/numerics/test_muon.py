"""Muon, beside that of PyTorch, which multiplies in bfloat16."""

from __future__ import annotations

import pytest

pytest.importorskip("torch", reason="needs the extra 'btf'")
import torch

from nacre.numerics.muon import Muon, like_adam, original, orthogonalized


@pytest.mark.parametrize("shape", [(32, 32), (40, 200), (200, 40)])
def test_singular_values_become_alike(shape):
    matrix = torch.randn(shape, generator=torch.Generator().manual_seed(0))
    found = torch.linalg.svdvals(orthogonalized(matrix))
    assert found.max() < 1.25
    assert found.median() > 0.6
    u, _, v = torch.linalg.svd(matrix, full_matrices=False)
    assert torch.nn.functional.cosine_similarity(
        orthogonalized(matrix).flatten(), (u @ v).flatten(), dim=0
    ) > (0.98 if shape[0] != shape[1] else 0.95)


@pytest.mark.parametrize(
    ("factor", "name"), [(like_adam, "match_rms_adamw"), (original, "original")]
)
@pytest.mark.parametrize("shape", [(48, 160), (160, 48)])
def test_steps_are_those_of_pytorch(factor, name, shape):
    generator = torch.Generator().manual_seed(1)
    start = torch.randn(shape, generator=generator)
    goal = torch.randn(shape, generator=generator)
    moved = []
    for make in (
        lambda p: Muon(p, 0.05, factor),
        lambda p: torch.optim.Muon(p, 0.05, weight_decay=0.0, adjust_lr_fn=name),
    ):
        matrix = start.clone().requires_grad_()
        optimizer = make([matrix])
        for _ in range(4):
            optimizer.zero_grad()
            (matrix - goal).square().mean().backward()
            optimizer.step()
        moved.append(matrix.detach() - start)
    assert (moved[0] - moved[1]).norm() < 0.02 * moved[1].norm()  # bfloat16 has 8 bits


def test_matrices_without_a_gradient_stay():
    matrix = torch.ones(4, 4, requires_grad=True)
    Muon([matrix], 0.1).step()
    assert (matrix == 1.0).all()


def test_a_state_that_was_kept_goes_on():
    def trained(steps, kept=None):
        matrix = torch.eye(4, 6).requires_grad_() if kept is None else kept[0].requires_grad_()
        optimizer = Muon([matrix], 0.1)
        if kept is not None:
            optimizer.load_state_dict(kept[1])
        for _ in range(steps):
            optimizer.zero_grad()
            (matrix**3).sum().backward()
            optimizer.step()
        return matrix.detach().clone(), optimizer.state_dict()

    whole, _ = trained(5)
    rest, _ = trained(3, trained(2))
    assert torch.equal(whole, rest)
