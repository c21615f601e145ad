"""Exports made of tensor operations: ONNX models and PyTorch modules."""

from __future__ import annotations

import base64
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import onnx
import onnx.numpy_helper
import pytest

from nacre.array import Components, Table, namespace
from nacre.brdf import Brdf
from nacre.neural import Layer, NeuralBrdf
from nacre.targets import TARGETS, identifier, program
from nacre.targets.tensors import compact, steps
from tests.analytic.materials import EXAMPLES
from tests.oracles.materials import material
from tests.oracles.pairs import pairs
from tests.oracles.runner import RUNNERS, reference, worst_error
from tests.targets.test_source import HOSTILE
from tests.tiers import tiered

torch = pytest.importorskip("torch", reason="needs the extra 'torch'")

COUNT = 4000


class _Odd(Brdf):
    """Every operation there is, in formulas that read otherwise without their parentheses."""

    isotropic = False
    _table = Table(np.arange(12.0) ** 2)

    def eval_components(self, wi: Components, wo: Components) -> Components:
        xp = namespace(*wi, *wo)
        (a, b, c), (x, y, z) = wi, wo
        index = xp.to_index(xp.abs(a) * 9.0)
        taken = xp.take(self._table, xp.minimum(index + 1, 10)) - xp.to_float(index, a)
        grows = xp.exp(xp.minimum(x, y)) - xp.log(xp.maximum(-(a - b), 0.1))
        sides = xp.where((a > b) & ~(x <= y) | (c != z), 2.0, -(a + b) - (b - (c - a)))
        turns = xp.sin(3.0 * a) * -xp.cos(b) / (1.5 + xp.arcsin(0.5 * x)) / (2.0 - y * (b - 3.0))
        angle = xp.arctan2(a - x, b * y) + xp.floor(4.0 * c) + xp.sqrt(xp.abs(x * y))
        return taken + 2.0 * grows, 20.0 + sides + angle, 3.0 - turns * 0.5


class _Gray(Brdf):
    """A reflectance that is a number in one channel, and in each channel another."""

    def eval_components(self, wi: Components, wo: Components) -> Components:
        return 0.5 + 0.0 * wi[2], 0.25 * wi[2], 0.125 * wo[2] - 0.0625


FORMULAS: Mapping[str, Brdf] = {"odd": _Odd(), "gray": _Gray(), **EXAMPLES}


def outputs(target: str, brdf: Brdf, function: str, *given: Any) -> Any:
    """What a function of an export returns: of onnxruntime, or of a module in this process."""
    files = TARGETS[target]().files(brdf, "x")
    if target == "onnx":
        return RUNNERS["onnxruntime"]().run(files, "x", function, *given)
    with torch.no_grad():
        call = getattr(module(files), "forward" if function == "eval" else function)
        return call(*map(torch.from_numpy, given)).numpy()


def module(files: Mapping[str, bytes]) -> Any:
    """The module of a file."""
    ((name, source),) = files.items()
    found: dict[str, Any] = {}
    exec(compile(source, name, "exec"), found)
    made = [v for v in found.values() if isinstance(v, type) and issubclass(v, torch.nn.Module)]
    return made[0]()


def directions() -> tuple[np.ndarray, np.ndarray]:
    return pairs(COUNT)


@pytest.mark.parametrize("target", ["onnx", "pytorch"])
@pytest.mark.parametrize("name", tiered(FORMULAS, list(FORMULAS)[::4]))
def test_formulas_and_tables_mean_what_they_mean_in_numpy(target: str, name: str) -> None:
    brdf, (wi, wo) = FORMULAS[name], directions()
    high = (wi[:, 2] > 1e-3) & (wo[:, 2] > 1e-3)  # where float32 resolves tables of angles
    for function in ("eval", "pdf"):
        found = outputs(target, brdf, function, wi[high], wo[high])
        expected = reference(brdf, function, wi[high], wo[high])
        error = np.abs(found - expected) > 5e-4 * np.abs(expected) + 1e-3
        # Either side of a step, as of floor, may be taken where float32 cannot tell.
        assert np.isfinite(found).all()
        assert error.mean() < (1e-3 if isinstance(brdf, _Odd) else 1e-9)


@pytest.mark.parametrize("target", ["onnx", "pytorch"])
def test_samples_are_those_of_numpy(target: str) -> None:
    brdf, (_, wo) = material("anisotropic"), directions()
    u = np.random.default_rng(0).random(wo.shape, np.float32)
    files = TARGETS[target]().files(brdf, "x")
    if target == "onnx":
        found = RUNNERS["onnxruntime"]().run(files, "x", "sample", wo, u)
    else:
        with torch.no_grad():
            wi, pdf = module(files).sample(torch.from_numpy(wo), torch.from_numpy(u))
        found = torch.cat([wi, pdf[:, None]], 1).numpy()
    wi, pdf = brdf.sample(wo.astype(float), u.astype(float))
    seen = wo[:, 2] > 0.0
    assert worst_error(found[seen], np.concatenate([wi, pdf[:, None]], 1)[seen]) <= 1.0
    np.testing.assert_allclose(np.linalg.norm(found[:, :3], axis=1), 1.0, rtol=1e-5)


def test_layers_are_products_and_their_activations_one_operation_each() -> None:
    found = steps(program(material("glossy"))["eval"]).steps
    layers = [step for step in found if step.name == "dense"]
    assert [step.rows for step in layers][-1] == 3
    assert len(layers) == 3
    # The inputs as one tensor, two layers, and two operations for each of their squared ReLUs.
    assert sum(step.rows > 3 for step in found) == 1 + 2 + 2 * 2
    assert len(found) < 80


def test_weights_in_half_precision_take_half_the_bytes() -> None:
    model = onnx.load_from_string(TARGETS["onnx"]().files(material("glossy"), "x")["x_eval.onnx"])
    kinds = {onnx.numpy_helper.to_array(x).dtype for x in model.graph.initializer if x.dims[1:]}
    assert kinds == {np.dtype(np.float16)}
    exact, more = np.float32([0.5, 1.25]), np.float32([0.1, 1e9])
    assert compact(exact).dtype == np.float16
    assert compact(more) is more


def test_a_model_says_what_it_is() -> None:
    brdf = material("glossy").replaced(source={"terms": "CC0"})
    for file, content in TARGETS["onnx"]().files(brdf, "x").items():
        model = onnx.load_from_string(content)
        onnx.checker.check_model(model, full_check=True)
        facts = {each.key: each.value for each in model.metadata_props}
        assert facts["terms"] == "Terms of the source: CC0"
        assert "1350 memory bytes" in facts["model"]
        assert "held-out loss" in facts["error"]
        assert "without the cosine" in facts["conventions"]
        assert model.graph.name == file.removesuffix(".onnx")
        shapes = [x.type.tensor_type.shape.dim[0].dim_param for x in model.graph.input]
        assert shapes == ["n", "n"]


@pytest.mark.parametrize("text", [*HOSTILE, "None", "class", "torch"])
def test_a_module_of_any_name_is_imported(text: str) -> None:
    brdf = material("glossy").replaced(name=text, source={"terms": text})
    files = TARGETS["pytorch"]().files(brdf, identifier(text))
    assert next(iter(files)).removesuffix("_brdf.py").isidentifier()
    assert len(list(module(files).parameters())) == 6


@pytest.mark.parametrize("text", tiered(HOSTILE, HOSTILE[:2]))
def test_names_reach_nothing_but_the_description_of_a_model(text: str) -> None:
    graphs = []
    for name in (text, "harmless"):
        brdf = material("glossy").replaced(name=name, source={"terms": name})
        model = onnx.load_from_string(TARGETS["onnx"]().files(brdf, "same")["same_eval.onnx"])
        graphs.append(model.graph.SerializeToString(deterministic=True))
    assert graphs[0] == graphs[1]


def test_the_same_material_gives_the_same_bytes() -> None:
    for target in ("onnx", "pytorch"):
        first, second = (TARGETS[target]().files(material("glossy"), "x") for _ in range(2))
        assert first == second


def test_gradients_of_a_module_are_slopes_and_finite_everywhere() -> None:
    exported = module(TARGETS["pytorch"]().files(material("anisotropic"), "x"))
    wi, wo = (torch.from_numpy(w).requires_grad_() for w in directions())
    exported(wi, wo).sum().backward()
    for tensor in (wi, wo, *exported.parameters()):
        assert torch.isfinite(tensor.grad).all()
        assert tensor.grad.abs().max() > 0.0
    above = torch.tensor([[0.3, 0.2, 0.9], [-0.5, 0.1, 0.4]], dtype=torch.float64)
    light = torch.nn.functional.normalize(above).requires_grad_()
    view = light.detach().flip(0).clone().requires_grad_()
    assert torch.autograd.gradcheck(exported.double(), (light, view))


def test_a_module_in_double_precision_is_exact() -> None:
    wi, wo = directions()
    for name in ("diffuse", "near mirror"):
        exported = module(TARGETS["pytorch"]().files(material(name), "x"))
        with torch.no_grad():
            found = exported(torch.from_numpy(wi).double(), torch.from_numpy(wo))
        expected = reference(material(name), "eval", wi, wo)
        assert found.dtype == torch.float64
        np.testing.assert_allclose(found.numpy(), expected, rtol=1e-5, atol=1e-5)


def test_a_module_broadcasts_and_is_traced() -> None:
    exported = module(TARGETS["pytorch"]().files(material("glossy"), "x"))
    wi, wo = (torch.from_numpy(w[:12]) for w in directions())
    whole = exported(wi.reshape(3, 4, 3), wo[0])
    assert whole.shape == (3, 4, 3)
    torch.testing.assert_close(whole.reshape(12, 3), exported(wi, wo[0].expand(12, 3)))
    assert exported.pdf(wi[0], wo[0]).shape == ()
    n = torch.export.Dim("n", max=1 << 20)
    traced = torch.export.export(exported, (wi, wo), dynamic_shapes=({0: n}, {0: n})).module()
    torch.testing.assert_close(traced(wi[:7], wo[:7]), exported(wi[:7], wo[:7]))


@pytest.mark.parametrize("made", [lambda: material("physical"), lambda: EXAMPLES["npf"]])
def test_a_module_stays_on_the_device_that_it_is_on(made: Callable[[], Brdf]) -> None:
    # Nothing is computed there, but tensors of two devices do not mix.
    exported = module(TARGETS["pytorch"]().files(made(), "x")).to("meta")
    w = torch.empty(5, 3, device="meta")
    found = exported(w, w), exported.pdf(w, w), *exported.sample(w, w)
    assert {each.device.type for each in found} == {"meta"}
    assert [each.shape for each in found] == [(5, 3), (5,), (5, 3), (5,)]


def test_weights_of_a_module_are_in_its_file_as_they_are() -> None:
    random = np.random.default_rng(0)
    layers = [Layer(random.normal(size=(a, b)), random.normal(size=b)) for a, b in ((6, 4), (4, 3))]
    ((_, source),) = TARGETS["pytorch"]().files(NeuralBrdf(layers), "x").items()
    last = base64.b64encode(layers[-1].biases.tobytes())
    assert last in source
    found = module({"x": source})
    np.testing.assert_array_equal(found.weights_2.detach().numpy(), layers[-1].weights)
