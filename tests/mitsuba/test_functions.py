"""Networks and functions of others as BSDFs: against PyTorch, JAX, Mitsuba and differences."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.errors import FormatError, NacreError
from nacre.mitsuba.functions import FormulaBrdf, reflectance
from nacre.mitsuba.wrapped import WrappedBrdf
from nacre.neural.chain import ChainBrdf
from nacre.numerics.mlp import Layer
from tests.measured.support import hemisphere

mi = pytest.importorskip("mitsuba", reason="needs the extra 'render'")
torch = pytest.importorskip("torch", reason="needs the extra 'torch'")
nn = torch.nn

PAIRS = hemisphere(np.random.default_rng(0), 400).astype(np.float32).reshape(2, 200, 3)


def module(*activations: object, inputs: int = 6) -> object:
    torch.manual_seed(0)
    steps: list[object] = [nn.Linear(inputs, 12)]
    for activation in activations:
        steps += [activation, nn.Linear(12, 12)]
    return nn.Sequential(*steps, nn.ReLU(), nn.Linear(12, 3), nn.Softplus())


def expected(network: object, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    joined = torch.from_numpy(np.concatenate([wi, wo], axis=1))
    with torch.no_grad():
        return network(joined).numpy()  # type: ignore[operator]


def in_mitsuba(bsdf: object, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    import drjit as dr

    m = nacre.mitsuba.mitsuba()
    si = dr.zeros(m.SurfaceInteraction3f, len(wi))
    si.wi = m.Vector3f(wo.T)
    value = bsdf.eval(m.BSDFContext(), si, m.Vector3f(wi.T))  # type: ignore[attr-defined]
    return np.array(value).T / wi[:, 2:]


class Skip(nn.Module):  # type: ignore[misc, name-defined]
    """No chain: a layer's values go around the next."""

    def __init__(self) -> None:
        super().__init__()
        torch.manual_seed(1)
        self.first, self.second, self.last = nn.Linear(6, 8), nn.Linear(8, 8), nn.Linear(8, 3)

    def forward(self, wi: object, wo: object) -> object:
        hidden = torch.relu(self.first(torch.cat([wi, wo], dim=-1)))
        return torch.exp(self.last(hidden + torch.relu(self.second(hidden))))


class TwoInputs(nn.Module):  # type: ignore[misc, name-defined]
    """A chain, written as a function."""

    def __init__(self) -> None:
        super().__init__()
        torch.manual_seed(2)
        self.steps = nn.Sequential(nn.Linear(6, 8, bias=False), nn.Dropout(0.5), nn.Identity())
        self.last = nn.Linear(8, 3)

    def forward(self, wi: object, wo: object) -> object:
        hidden = torch.nn.functional.leaky_relu(self.steps(torch.cat((wi, wo), -1)), 0.2)
        return self.last(torch.tanh(hidden)).exp()


ACTIVATIONS = [
    nn.ReLU6(),
    nn.LeakyReLU(0.3),
    nn.ELU(0.7),
    nn.Tanh(),
    nn.Sigmoid(),
    nn.SiLU(),
    nn.Softplus(2.0),
    nn.GELU(),
]


@pytest.mark.parametrize("activation", ACTIVATIONS, ids=lambda a: type(a).__name__)
def test_a_chain_is_its_module(activation: object) -> None:
    network = module(activation)
    made = reflectance(network)
    assert isinstance(made, ChainBrdf)
    truth = expected(network, *PAIRS)
    np.testing.assert_allclose(made.eval(*PAIRS), truth, rtol=1e-5, atol=1e-6)
    for weights in ["literals"] + ["cooperative"] * made.cooperative:
        bsdf = nacre.mitsuba.bsdf(network, weights=weights)
        np.testing.assert_allclose(in_mitsuba(bsdf, *PAIRS), truth, rtol=2e-5, atol=2e-6)
    if not made.cooperative:
        with pytest.raises(NacreError, match="cannot have the activations gelu"):
            nacre.mitsuba.bsdf(network, weights="cooperative")


def test_a_module_written_as_a_function_is_a_chain() -> None:
    network = TwoInputs().eval()
    made = reflectance(network)
    assert isinstance(made, ChainBrdf)
    assert made.activations == ("leaky relu 0.2", "tanh", "exp")
    with torch.no_grad():
        truth = network(*map(torch.from_numpy, PAIRS)).numpy()
    np.testing.assert_allclose(made.eval(*PAIRS), truth, rtol=1e-5)


@pytest.mark.parametrize("inputs", ["rusinkiewicz vectors", "rusinkiewicz angles", "own"])
def test_chains_see_other_inputs(inputs: str) -> None:
    from nacre.geometry import half_difference, rusinkiewicz_angles, split

    light, view = map(split, PAIRS)
    count = 6 if inputs == "rusinkiewicz vectors" else 3
    network = module(inputs=count)
    if inputs == "own":
        features = [light[2], view[2], sum(a * b for a, b in zip(light, view, strict=True))]
        seen = lambda a, b: (a[2], b[2], a[0] * b[0] + a[1] * b[1] + a[2] * b[2])  # noqa: E731
    else:
        h, d = half_difference(light, view)
        angles = rusinkiewicz_angles(light, view)
        features = [*h, *d] if count == 6 else [angles[0], angles[2], angles[3]]
        seen = inputs  # type: ignore[assignment]
    made = reflectance(network, inputs=seen, isotropic=count == 3)
    with torch.no_grad():
        truth = network(torch.from_numpy(np.stack(features, -1)).float()).numpy()
    np.testing.assert_allclose(made.eval(*PAIRS), truth, rtol=1e-4, atol=1e-5)
    assert made.isotropic == (count == 3)
    bsdf = nacre.mitsuba.bsdf(made)
    np.testing.assert_allclose(in_mitsuba(bsdf, *PAIRS), truth, rtol=1e-3, atol=1e-4)


def test_a_chain_is_saved_and_exported(tmp_path: Path) -> None:
    made = reflectance(module(nn.SiLU()), name="mine")
    path = tmp_path / "mine.safetensors"
    nacre.save(made, path)
    again = nacre.load(path)
    assert isinstance(again, ChainBrdf)
    assert (again.name, again.activations, again.inputs) == ("mine", made.activations, "directions")
    assert again.sampler == made.sampler
    np.testing.assert_array_equal(again.eval(*PAIRS), made.eval(*PAIRS))
    nacre.save(again, tmp_path / "again.safetensors")
    assert (tmp_path / "again.safetensors").read_bytes() == path.read_bytes()
    assert "silu" in str(again.describe())
    own = reflectance(module(inputs=2), inputs=lambda a, b: (a[2], b[2]))
    with pytest.raises(FormatError, match="inputs are a function"):
        nacre.save(own, tmp_path / "own.safetensors")


def test_what_is_no_chain_is_called() -> None:
    network = Skip()
    made = reflectance(network)
    assert isinstance(made, WrappedBrdf)
    with torch.no_grad():
        truth = network(*map(torch.from_numpy, PAIRS)).numpy()
    np.testing.assert_allclose(made.eval(*PAIRS), truth, rtol=1e-5)
    bsdf = nacre.mitsuba.bsdf(network)
    np.testing.assert_allclose(in_mitsuba(bsdf, *PAIRS), truth, rtol=1e-4)
    with pytest.raises(NacreError, match="takes another one's values"):
        nacre.mitsuba.bsdf(network, inputs="directions")


def test_a_function_of_jax() -> None:
    jax = pytest.importorskip("jax", reason="needs the extra 'jax'")
    function = jax.jit(lambda wi, wo: 0.2 + 0.1 * wi[:, 2:] * wo[:, 2:] * np.ones(3, np.float32))
    truth = 0.2 + 0.1 * PAIRS[0][:, 2:] * PAIRS[1][:, 2:] * np.ones(3)
    made = reflectance(function, isotropic=True, name="jax")
    assert isinstance(made, WrappedBrdf)
    np.testing.assert_allclose(made.eval(*PAIRS), truth, rtol=1e-5)
    np.testing.assert_allclose(in_mitsuba(nacre.mitsuba.bsdf(made), *PAIRS), truth, rtol=1e-4)


def scene(bsdf: object, size: int = 24) -> object:
    m = nacre.mitsuba.mitsuba()
    look = m.ScalarTransform4f().look_at([0, -4, 0], [0, 0, 0], [0, 0, 1])
    film = {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}}
    return m.load_dict({
        "type": "scene",
        "integrator": {"type": "prb", "max_depth": 3},
        "sphere": {"type": "sphere", "bsdf": bsdf},
        "light": {"type": "directional", "direction": [-0.5, 1.0, -0.5]},
        "sky": {"type": "constant", "radiance": 0.3},
        "sensor": {"type": "perspective", "fov": 32, "to_world": look, "film": film},
    })  # fmt: skip


def test_a_formula_renders_as_mitsubas_own() -> None:
    m = nacre.mitsuba.mitsuba()
    color = (0.6, 0.4, 0.2)
    made = nacre.mitsuba.bsdf(lambda wi, wo: tuple(c / math.pi for c in color), isotropic=True)
    assert isinstance(made.material(), FormulaBrdf)
    own = {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(color)}}
    pictures = [np.array(m.render(scene(b), spp=256, seed=3)) for b in (made, own)]
    np.testing.assert_allclose(*pictures, rtol=0.04)  # noise: other random numbers
    np.testing.assert_allclose(*(picture.mean(axis=(0, 1)) for picture in pictures), rtol=1e-3)


def test_gradients_of_a_called_module_are_differences() -> None:
    import drjit as dr

    m = nacre.mitsuba.mitsuba()
    made = scene(nacre.mitsuba.bsdf(Skip()), 12)
    parameters = m.traverse(made)
    key = "sphere.bsdf.weights"
    with nacre.mitsuba.wavefronts():
        dr.enable_grad(parameters[key])
        parameters.update()
        dr.backward(dr.mean(m.render(made, parameters, spp=16, seed=1) ** 2))
        gradient = np.array(dr.grad(parameters[key]))
        start = np.array(dr.detach(parameters[key]))

        def loss(index: int, step: float) -> float:
            moved = start.copy()
            moved[index] += step
            parameters[key] = m.Float(moved)
            parameters.update()
            return float(np.mean(np.array(m.render(made, spp=16, seed=1), np.float64) ** 2))

        for index in np.argsort(np.abs(gradient))[-3:]:
            difference = (loss(index, 0.01) - loss(index, -0.01)) / 0.02
            assert gradient[index] == pytest.approx(difference, rel=0.03)


def found_again(network: object, steps: int) -> tuple[float, float]:
    """Errors of f_r before and after weights that were moved are fitted to a picture."""
    import drjit as dr

    m = nacre.mitsuba.mitsuba()
    truth = reflectance(network)
    assert isinstance(truth, ChainBrdf)
    picture = m.TensorXf(m.render(scene(nacre.mitsuba.bsdf(truth)), spp=128, seed=9))
    random = np.random.default_rng(5)
    moved = [
        Layer(*(a + 0.15 * random.standard_normal(a.shape) for a in layer))
        for layer in truth.layers
    ]
    bsdf = nacre.mitsuba.bsdf(truth.with_layers(moved), weights="cooperative")
    made = scene(bsdf)
    parameters = m.traverse(made)
    key = "sphere.bsdf.weights"
    optimizer = m.ad.Adam(lr=0.01)
    optimizer[key] = parameters[key]
    parameters.update(optimizer)

    def error() -> float:
        return float(np.abs(bsdf.material().eval(*PAIRS) - truth.eval(*PAIRS)).mean())

    before = error()
    for step in range(steps):
        image = m.render(made, parameters, spp=8, seed=step)
        dr.backward(dr.mean((image - picture) ** 2))
        optimizer.step()
        parameters.update(optimizer)
    return before, error()


def test_weights_are_found_again_from_a_picture() -> None:
    network = nn.Sequential(
        nn.Linear(6, 10), nn.SiLU(), nn.Linear(10, 10), nn.Tanh(), nn.Linear(10, 3), nn.Softplus()
    )
    before, after = found_again(network, 60)
    assert after < 0.4 * before


def test_bad_functions_are_refused() -> None:
    with pytest.raises(NacreError, match="neither a material nor a function"):
        nacre.mitsuba.bsdf(3)
    with pytest.raises(NacreError, match="library 'numpy' is none of"):
        nacre.mitsuba.bsdf(lambda wi, wo: wi, library="numpy")
    with pytest.raises(NacreError, match="inputs are for modules"):
        nacre.mitsuba.bsdf(lambda wi, wo: wi, inputs="directions")
    with pytest.raises(NacreError, match="goes from 3 inputs to 3 outputs"):
        nacre.mitsuba.bsdf(module(), inputs="rusinkiewicz angles")
    with pytest.raises(NacreError, match="none of directions"):
        nacre.mitsuba.bsdf(module(), inputs="angles")
    wide = reflectance(lambda wi, wo: wi[:, :2], library="torch", name="wide")
    with pytest.raises(NacreError, match=r"wide: returned shape \(200, 2\)"):
        wide.eval(*PAIRS)
    with pytest.raises(ValueError, match="activation 'swish' is none of"):
        ChainBrdf([Layer(np.zeros((6, 3)), np.zeros(3))], ["swish"])
    with pytest.raises(ValueError, match="1 layers have 2 activations"):
        ChainBrdf([Layer(np.zeros((6, 3)), np.zeros(3))], ["relu", ""])
