"""The recipe over many materials at once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import nacre
from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.neural import Recipe, fit, fit_many
from nacre.neural.fit_data import prepare
from nacre.neural.kernel import KernelTrainer
from nacre.neural.training import train
from nacre.runtime.progress import silent
from tests.data import list_data, require_data
from tests.reflectances import Brushed, Glossy
from tests.scans import scan

torch = pytest.importorskip("torch", reason="needs the extra 'latent'")
from nacre.neural.torch import TorchTrainer  # noqa: E402  (needs the optional dependency)

QUICK = Recipe(epochs=3, samples=20_000)


class Unknown(Glossy):
    """Nowhere a valid sample."""

    name = "unknown"

    def valid_components(self, wi, wo):
        return wi[2] > 2.0


class Blinding(Brdf):
    """Finite, but no longer once its loss is computed."""

    name = "blinding"

    def eval_components(self, wi, wo):
        huge = 3e38 + 0.0 * wi[2]
        return huge, huge, huge


def metals(count: int) -> list[Glossy]:
    return [Glossy(0.1, 0.3, 0.2 + 0.1 * k).replaced(name=f"metal {k}") for k in range(count)]


def stacks(calls: list[tuple]) -> int:
    """How many batches were trained, by what was reported."""
    return sum(call[:2] == ("training", 1) for call in calls)


def losses(network) -> list[float]:
    return [network.metadata["quality"][name] for name in ("training_loss", "held_out_loss")]


def same(one, other) -> bool:
    """Whether networks differ no more than rounding makes them, which grows with every step."""
    weights = (
        np.concatenate([a.ravel() for y in network.layers for a in (y.weights, y.biases)])
        for network in (one, other)
    )
    return np.allclose(*weights, rtol=0, atol=0.03) and np.allclose(
        losses(one), losses(other), rtol=5e-3
    )


def alone(material: Brdf, recipe: Recipe):
    """The network of one material by the compiled kernel."""
    data = prepare(material, replace(recipe, starts=1), silent)
    settings = data.recipe
    trainer = KernelTrainer(data.initial_layers(), settings.batch, settings.hidden_activation)
    quality = train(trainer, data.training, data.held_out, settings)
    return data.finish(trainer.layers(), quality)


def test_materials_that_cannot_share_a_batch_are_fitted_in_batches_of_their_kind():
    recipe = Recipe(epochs=4, samples=20_000, inputs="enhanced")
    materials = [*metals(2), Brushed(), scan(Glossy(0.3, 0.05, 0.3)), *metals(1)]
    calls: list[tuple] = []
    results = dict(fit_many(materials, recipe, device="cpu", progress=lambda *c: calls.append(c)))
    assert sorted(results) == list(range(5))
    assert stacks(calls) == 3
    assert list(dict.fromkeys(call[0] for call in calls)) == [
        "sampling",
        "training",
        "sampling lobes",
    ]
    for index, material in enumerate(materials):
        expected, network = alone(material, recipe), results[index]
        # Rounding alone moves the losses of so short a fit to a scan by two percent.
        assert losses(network) == pytest.approx(losses(expected), rel=0.05)
        assert network.name == expected.name
        assert network.isotropic == expected.isotropic
        assert network.metadata["fit"] == expected.metadata["fit"]
        assert network.metadata["quality"].keys() == expected.metadata["quality"].keys()


def test_a_network_does_not_depend_on_those_beside_it():
    materials = metals(3)
    together = dict(fit_many(materials, QUICK, device="cpu"))
    for index, material in enumerate(materials):
        assert same(together[index], fit(material, QUICK, device="cpu"))
    assert not same(together[0], together[1])


@pytest.mark.filterwarnings("ignore:overflow encountered")
def test_bad_materials_fail_alone():
    first, last = metals(2)
    # With a gain, its targets are infinite; without valid samples, there are none.
    recipe = Recipe(epochs=2, samples=20_000, inputs="enhanced", precision="single")
    results = dict(
        fit_many([first, Unknown(0.1, 0.1, 0.1), Blinding(), last], recipe, device="cpu")
    )
    assert sorted(results) == list(range(4))
    for index, message in ((1, "unknown: hardly any sample is valid"), (2, "blinding: training")):
        assert isinstance(results[index], NacreError)
        assert message in str(results[index])
    for index, material in ((0, first), (3, last)):
        assert same(results[index], fit(material, recipe, device="cpu"))


def test_materials_are_taken_one_by_one_and_trained_when_there_is_no_more_room(monkeypatch):
    monkeypatch.setattr("nacre.neural.torch.stack_bytes", lambda device: 1_000_000)
    taken: list[int] = []

    def materials():
        for k, material in enumerate(metals(5)):
            taken.append(k)
            yield material

    calls: list[tuple] = []
    fits = fit_many(materials(), QUICK, device="cpu", progress=lambda *call: calls.append(call))
    assert next(fits)[0] == 0
    assert taken == [0, 1]  # two of 800 KB are a full stack
    assert sorted(index for index, _ in fits) == [1, 2, 3, 4]
    assert stacks(calls) == 3


def test_no_materials_are_no_fits():
    assert list(fit_many([], QUICK, device="cpu")) == []


def test_a_device_that_is_not_there_is_named_before_any_work():
    with pytest.raises(NacreError, match="'abacus'"):
        fit_many([None], QUICK, device="abacus")


def test_memory_that_runs_out_is_one_line(monkeypatch):
    def exhausted(*_):
        raise torch.OutOfMemoryError("CUDA out of memory. Tried to allocate\n a lot")

    monkeypatch.setattr(TorchTrainer, "epoch", exhausted)
    with pytest.raises(NacreError, match=r"^device 'cpu': CUDA out of memory. Tried to allocate$"):
        fit(metals(1)[0], QUICK, device="cpu")


def test_one_material_on_a_device_fails_as_it_does_on_the_kernel():
    for device in (None, "cpu"):
        with pytest.raises(NacreError, match="unknown: hardly any sample is valid"):
            fit(Unknown(0.1, 0.1, 0.1), QUICK, device=device)


@pytest.mark.parametrize("name", list_data("rgl", "*.bsdf")[:1] or ["satin_rosaline_rgb.bsdf"])
def test_a_real_table_reaches_the_loss_of_the_kernel(name):
    brdf = nacre.load(require_data("rgl", name))
    recipe = Recipe(epochs=8, samples=80_000)
    ((_, network),) = fit_many([brdf], recipe, device="cpu")
    assert losses(network) == pytest.approx(losses(alone(brdf, recipe)), rel=0.05)
    assert network.metadata["source"]["file"] == name
