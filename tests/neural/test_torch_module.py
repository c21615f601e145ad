"""Networks as PyTorch modules: against formulas written out, NumPy, and each other."""

from __future__ import annotations

import copy
import itertools

import numpy as np
import pytest

import nacre
from nacre.neural import Layer, NeuralBrdf
from nacre.neural.inputs import ENHANCED, PAPER, STEREOGRAPHIC, has_axes, input_count
from nacre.numerics.mlp import RELU, SQUARED_RELU
from nacre.sampling import fit_lobes
from tests.reflectances import Glossy

torch = pytest.importorskip("torch", reason="needs the extra 'torch'")
from nacre.neural.torch import module  # noqa: E402  (needs PyTorch)

KINDS = [
    *((inputs, isotropic) for inputs in (PAPER, ENHANCED) for isotropic in (True, False)),
    (STEREOGRAPHIC, False),
]
NAMES = [f"{inputs}-{'isotropic' if isotropic else 'anisotropic'}" for inputs, isotropic in KINDS]


def network(kind, seed=0, hidden=(12, 9), **options):
    inputs, isotropic = kind
    random = np.random.default_rng(seed)
    sizes = (input_count(inputs, isotropic), *hidden, 3)
    layers = [
        Layer(random.normal(0, 0.5, (a, b)), random.normal(0.1, 0.1, b))
        for a, b in itertools.pairwise(sizes)
    ]
    angle = 0.2 * (seed + 1) if has_axes(inputs, isotropic) else 0.0
    activation = SQUARED_RELU if inputs == ENHANCED else RELU
    options = {"activation": activation, "angle": angle} | options
    return NeuralBrdf(layers, isotropic=isotropic, inputs=inputs, **options)


def pairs(count, dtype, seed=3):
    """Directions in all of the sphere, a quarter of the pairs above the horizon."""
    random = np.random.default_rng(seed)
    w = random.normal(size=(2, count, 3))
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    return tuple(torch.tensor(x, dtype=dtype) for x in w)


def above(count, seed=3):
    wi, wo = pairs(count, torch.float64, seed)
    return tuple(torch.cat([w[:, :2], w[:, 2:].abs()], 1) for w in (wi, wo))


def tangent(gradient, w):
    """The part of a gradient along the sphere: formulas may differ off it."""
    return gradient - (gradient * w).sum(-1, keepdim=True) * w


def written_out(made, wi, wo):
    """The formula by angles and rotation matrices, as papers write it."""

    def angles(w):
        return torch.atan2(torch.hypot(w[:, 0], w[:, 1]), w[:, 2]), torch.atan2(w[:, 1], w[:, 0])

    def turned(w, axis, angle):
        c, s, zero, one = angle.cos(), angle.sin(), 0 * angle, 0 * angle + 1
        rows = {"y": (c, zero, s, zero, one, zero, -s, zero, c)}
        rows["z"] = (c, -s, zero, s, c, zero, zero, zero, one)
        matrices = torch.stack(rows[axis], -1).reshape(-1, 3, 3)
        return torch.einsum("nij,nj->ni", matrices, w)

    if made.networks[0].angle:
        angle = torch.full_like(wi[:, 0], -made.networks[0].angle)
        wi, wo = turned(wi, "z", angle), turned(wo, "z", angle)
    h = torch.nn.functional.normalize(wi + wo, dim=-1)
    theta, phi = angles(h)
    d = turned(turned(wi, "z", -phi), "y", -theta)
    seen = turned(h, "z", -phi) if made.isotropic else h
    if made.inputs == PAPER:
        inputs = [*seen.T, *d.T]
    elif made.inputs == ENHANCED:
        grazing = [torch.log(angles(w)[0].cos() + 0.01) / 4.6 for w in (wi, wo)]
        if made.isotropic:
            stretched = torch.log(theta.sin() ** 2 + 1e-4) / 9.2
            inputs = [seen[:, 0], stretched, *grazing, d[:, 0], d[:, 1].abs()]
        else:
            along, across = torch.log(h[:, :2] ** 2 + 1e-3).T / 6.91
            inputs = [*h[:, :2].T, along, across, *grazing, *turned(d, "z", phi)[:, :2].T]
    else:
        discs = (
            (angles(w)[0] / 2).tan() * f(angles(w)[1])
            for w in (wi, wo)
            for f in (torch.cos, torch.sin)
        )
        inputs = list(discs)
    x = torch.stack(inputs, -1)
    for index, (w, b) in enumerate(zip(made.weights, made.biases, strict=True)):
        x = x @ w + b
        if index < len(made.weights) - 1:
            x = x.clamp(min=0) ** (2 if made.activation == SQUARED_RELU else 1)
        else:
            x = x.exp() - 1
    return x.clamp(min=0)


@pytest.mark.parametrize("kind", KINDS, ids=NAMES)
def test_gradients_are_those_of_the_formula_written_out(kind):
    made = module(network(kind)).double()
    wi, wo = (w.requires_grad_() for w in above(60))
    weights = torch.rand(60, 3, dtype=torch.float64)
    found = []
    for values in (made(wi, wo), written_out(made, wi, wo)):
        leaves = (wi, wo, *made.parameters())
        light, view, *rest = torch.autograd.grad((values * weights).sum(), leaves)
        found.append((values, tangent(light, wi), tangent(view, wo), *rest))
    assert found[0][0].gt(0).any()
    for ours, theirs in zip(*found, strict=True):
        torch.testing.assert_close(ours, theirs, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("kind", KINDS, ids=NAMES)
def test_gradients_are_those_of_differences(kind):
    made = module(network(kind, hidden=(5,))).double()
    wi, wo = (w.requires_grad_() for w in above(4))
    names, parameters = zip(*made.named_parameters(), strict=True)

    def values(wi, wo, *given):
        state = dict(zip(names, given, strict=True))
        return torch.func.functional_call(made, state, (wi, wo))

    assert torch.autograd.gradcheck(values, (wi, wo, *parameters))


@pytest.mark.parametrize("kind", KINDS, ids=NAMES)
@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_values_are_those_of_numpy(kind, dtype):
    brdf = network(kind)
    wi, wo = pairs(40_000, dtype)  # several chunks
    expected = torch.from_numpy(brdf.eval(wi.numpy(), wo.numpy()))
    made = module(brdf)
    for values in (made(wi, wo), made.requires_grad_(False)(wi, wo)):
        assert values.dtype == dtype
        assert values.is_contiguous()
        torch.testing.assert_close(values, expected, rtol=2e-4, atol=2e-5)
    assert (values[(wi[:, 2] <= 0) | (wo[:, 2] <= 0)] == 0).all()


SLANTED, ACROSS = (0.6, 0.0, 0.8), (-0.6, 0.0, 0.8)
SPECIAL = {
    "both at the normal": ((0.0, 0.0, 1.0), (0.0, 0.0, 1.0)),
    "equal": (SLANTED, SLANTED),
    "half vector at the pole": (SLANTED, ACROSS),
    "half vector next to the pole": (SLANTED, (-0.6, 1e-20, 0.8)),
    "opposite": (SLANTED, (-0.6, 0.0, -0.8)),
    "opposite at the horizon": ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)),
    "opposite just above the horizon": ((1.0, 0.0, 1e-30), (-1.0, 0.0, 1e-30)),
    "one at the horizon": ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    "both below": ((0.0, 0.0, -1.0), (0.0, 0.0, -1.0)),
}


@pytest.mark.parametrize("kind", KINDS, ids=NAMES)
@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_gradients_are_finite_everywhere(kind, dtype):
    wi, wo = torch.tensor(list(SPECIAL.values()), dtype=dtype).unbind(1)
    made = module(network(kind))
    for light, view in ((wi, wo), (wo, wi)):
        light, view = light.clone().requires_grad_(), view.clone().requires_grad_()
        values = made(light, view)
        found = torch.autograd.grad(values.sum(), (light, view, *made.parameters()))
        assert all(gradient.isfinite().all() for gradient in (values, *found))
        hidden = (light[:, 2] <= 0) | (view[:, 2] <= 0)
        assert (found[0][hidden] == 0).all()


def test_outputs_that_overflow_have_finite_values_and_gradients():
    brdf = network((PAPER, True))
    last = Layer(brdf.layers[-1].weights, np.full(3, 1000.0))
    made = module(brdf.with_layers([*brdf.layers[:-1], last]))
    values = made(*(torch.tensor(w).float() for w in (SLANTED, SLANTED)))
    values.sum().backward()
    assert values.isfinite().all()
    assert all(p.grad.isfinite().all() for p in made.parameters())


@pytest.mark.parametrize("kind", KINDS, ids=NAMES)
def test_a_stack_gives_what_each_network_gives(kind):
    networks = [network(kind, seed) for seed in range(3)]
    made, single = module(networks), [module(one) for one in networks]
    wi, wo = (w.view(3, 20, 3) for w in pairs(60, torch.float64))
    for light, view in ((wi, wo), (wi[0], wo[0]), (wi[:1], wo), (wi[:, :1], wo[0]), (wi[0, 0], wo)):
        light, view = light.clone().requires_grad_(), view.clone().requires_grad_()
        values = made(light, view)
        spread = (w.expand(3, 20, 3) for w in (light, view))
        expected = torch.stack([one(*w) for one, *w in zip(single, *spread, strict=True)])
        torch.testing.assert_close(values, expected)
        parts = [[p[i] for p in made.parameters()] for i in range(3)]
        assert [p.shape for p in parts[0]] == [p.shape for p in single[0].parameters()]
        ours = torch.autograd.grad(values.square().sum(), (light, view, *made.parameters()))
        leaves = [p for one in single for p in one.parameters()]
        theirs = torch.autograd.grad(expected.square().sum(), (light, view, *leaves))
        torch.testing.assert_close(ours[:2], theirs[:2])
        count = len(parts[0])
        for index, gradient in enumerate(theirs[2:]):
            torch.testing.assert_close(ours[2 + index % count][index // count], gradient)
    shared = made.requires_grad_(False)(wi[0, 0], wo[0, 0])
    assert shared.shape == (3, 1, 3)


def test_large_stacks_are_evaluated_in_parts():
    networks = [network((ENHANCED, True), seed) for seed in range(5)]
    wi, wo = pairs(8_000, torch.float32)
    made = module(networks)
    values = made.requires_grad_(False)(wi, wo)
    for one, ours in zip(networks, values, strict=True):
        expected = torch.from_numpy(one.eval(wi.numpy(), wo.numpy()))
        torch.testing.assert_close(ours, expected, rtol=2e-4, atol=2e-5)


@pytest.mark.slow
@pytest.mark.parametrize("stacked", [False, True])
def test_compiles_without_graph_breaks(stacked):
    brdf = network((ENHANCED, True), hidden=(4,))
    made = module([brdf, brdf] if stacked else brdf)
    compiled = torch.compile(made, backend="eager", fullgraph=True)  # inductor takes half a minute
    wi, wo = (w.requires_grad_() for w in above(5))
    found = []
    for function in (made, compiled):
        values = function(wi, wo)
        found.append((values, *torch.autograd.grad(values.sum(), (wi, wo, *made.parameters()))))
    torch.testing.assert_close(*found)


def test_vectorized_maps_and_jacobians_go_through():
    made = module(network((PAPER, True))).double()
    wi, wo = above(6)
    by_map = torch.func.vmap(torch.func.jacrev(made))(wi, wo)
    by_rows = [
        torch.autograd.functional.jacobian(lambda w, v=v: made(w, v), w)
        for w, v in zip(wi, wo, strict=True)
    ]
    torch.testing.assert_close(by_map, torch.stack(by_rows))


@pytest.mark.parametrize("precision", ["single", "half"])
def test_trained_weights_make_a_network_that_can_be_saved(precision, tmp_path):
    brdf = network((PAPER, True), precision="single")
    layers = [Layer(*(a.astype(np.float16) for a in layer)) for layer in brdf.layers]
    facts = {"source": {"file": "a"}, "quality": {"held_out_loss": 0.5}, "fit": {"epochs": 3}}
    brdf = NeuralBrdf(layers, name="satin", precision=precision, metadata=facts)
    made = module(brdf)
    assert made.brdf() is brdf
    with torch.no_grad():
        for parameter in made.parameters():
            parameter.add_(torch.rand_like(parameter) * 0.01)
    trained = made.brdf()
    assert (trained.name, trained.precision) == ("satin", precision)
    assert trained.metadata == {"source": {"file": "a"}}
    nacre.save(trained, tmp_path / "a.safetensors")
    read = module(nacre.load(tmp_path / "a.safetensors"))
    tolerance = {"single": 0.0, "half": 1e-3}[precision]
    for ours, theirs in zip(read.parameters(), made.parameters(), strict=True):
        torch.testing.assert_close(ours, theirs, rtol=tolerance, atol=0.0)
    with torch.no_grad():
        made.biases[0][0] = float("nan")
    with pytest.raises(ValueError, match="not finite"):
        made.brdf()


def test_networks_of_a_stack_are_given_back_one_by_one():
    networks = [network((PAPER, True), seed) for seed in range(2)]
    made = module(networks)
    assert [made.brdf(0), made.brdf(1)] == networks
    with torch.no_grad():
        made.biases[-1][1] += 1.0
    assert made.brdf(0) is networks[0]
    np.testing.assert_array_equal(made.brdf(1).layers[-1].biases, networks[1].layers[-1].biases + 1)
    with pytest.raises(IndexError):
        made.brdf(2)


def test_a_network_is_fitted_to_samples_of_another_reflectance():
    made = module(network((ENHANCED, True), hidden=(16, 16)))
    wi, wo = (w.float() for w in above(4096))
    target = torch.from_numpy(Glossy(0.3, 0.05, 0.3).eval(wi.numpy(), wo.numpy()))
    optimizer = torch.optim.Adam(made.parameters(), 0.01)
    errors = []
    for _ in range(120):
        optimizer.zero_grad()
        error = (made(wi, wo).log1p() - target.log1p()).abs().mean()
        error.backward()
        optimizer.step()
        errors.append(error.item())
    assert errors[-1] < 0.1 * errors[0]
    trained = made.brdf()
    trained = trained.replaced(sampler=fit_lobes(trained))
    assert trained.pdf([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]) > 0


def test_copies_do_not_share_weights():
    made = module(network((PAPER, True)))
    other = copy.deepcopy(made)
    with torch.no_grad():
        other.biases[-1].add_(1.0)
    wi, wo = above(5)
    assert not torch.equal(made(wi, wo), other(wi, wo))
    other.load_state_dict(made.state_dict())
    assert torch.equal(made(wi, wo), other(wi, wo))


def test_bad_shapes_are_refused():
    made, stack = (module(x) for x in (network((PAPER, True)), [network((PAPER, True))] * 2))
    one = torch.tensor([0.0, 0.0, 1.0])
    for function in (made, stack, made.brdf().eval):
        with pytest.raises(ValueError, match=r"expected wo of shape \(..., 3\), got \(2,\)"):
            function(one, one[:2])
        with pytest.raises(ValueError, match=r"do not broadcast: wi \(4, 3\), wo \(5, 3\)"):
            function(one.expand(4, 3), one.expand(5, 3))
    for shape in ((3, 5, 3), (1, 2, 5, 3)):
        with pytest.raises(ValueError, match=r"broadcast to \(2, n, 3\), got"):
            stack(one, one.expand(shape))
    assert made(one.expand(0, 3), one).shape == (0, 3)
    assert stack(one.expand(0, 3), one).shape == (2, 0, 3)


def test_what_cannot_be_a_module_is_refused():
    with pytest.raises(TypeError, match=r"got Glossy; nacre\.fit makes networks"):
        module([network((PAPER, True)), Glossy(0.3, 0.05, 0.3)])
    with pytest.raises(ValueError, match="at least one"):
        module([])
    with pytest.raises(ValueError, match=r"0 is 6-12-9-3, paper .*; 1 is 6-12-9-3, enhanced"):
        module([network((PAPER, True)), network((ENHANCED, True))])


@pytest.mark.skipif(not torch.cuda.is_available(), reason="PyTorch has no CUDA device here")
@pytest.mark.parametrize("kind", KINDS, ids=NAMES)
def test_values_and_gradients_on_cuda_are_those_on_the_cpu(kind):
    brdf = network(kind)
    made = module([brdf, brdf])
    found = []
    for device in ("cpu", "cuda"):
        wi, wo = (w.to(device).requires_grad_() for w in above(500))
        on_device = copy.deepcopy(made).to(device)
        values = on_device(wi, wo)
        leaves = (wi, wo, *on_device.parameters())
        followed = brdf.eval(wi, wo)
        assert followed.device.type == device
        found.append((values, followed, *torch.autograd.grad(values.sum(), leaves)))
    for ours, theirs in zip(*found, strict=True):
        torch.testing.assert_close(theirs.cpu(), ours, rtol=1e-5, atol=1e-6)
