"""Hypernetworks and autoencoders: codes as ordinary networks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import nacre
from nacre.errors import FormatError, NacreError
from nacre.latent import Autoencoder, Hypernetwork
from nacre.latent.directions import isotropic_inputs, shared_directions
from nacre.latent.picture_errors import PictureErrors
from nacre.latent.weights import (
    COUNT,
    network_layers,
    tensor_reflectance,
    weight_tangents,
    with_tangents,
)
from nacre.measured import MerlBrdf
from nacre.neural import NeuralBrdf
from nacre.neural.inputs import PAPER
from nacre.neural.prune import without_inactive_units
from nacre.numerics.channels import CHROMA
from nacre.numerics.mlp import flat_weights, forward
from nacre.sampling import GgxMixture
from tests.latent.made import GRID, random_autoencoder, random_basis, random_hypernetwork
from tests.reflectances import Brushed

WI, WO = shared_directions(2000, 11)
INPUTS = isotropic_inputs(WI, WO, PAPER)
CODE = np.array([0.4, -1.2, 0.7, 0.1, 0.8, -0.5])


def test_weights_become_layers_and_come_back():
    weights = np.arange(COUNT, dtype=np.float32)
    layers = network_layers(weights)
    assert [layer.weights.shape for layer in layers] == [(6, 21), (21, 21), (21, 3)]
    assert layers[0].biases[0] == 126
    np.testing.assert_array_equal(flat_weights(layers), weights)


def test_a_code_is_a_material_like_any_other(tmp_path: Path):
    material = random_hypernetwork().decode(CODE, "Farbe")
    assert isinstance(material, NeuralBrdf)
    assert (material.sizes, material.weight_count, material.nbytes) == (
        (6, 21, 21, 3),
        675,
        2700,
    )
    assert isinstance(material.sampler, GgxMixture)
    facts = material.describe()
    assert (facts["code dim"], facts["weights"]) == (6, 675)
    f = material.eval(WI, WO)
    assert f.max() > 0
    pruned = without_inactive_units(material)
    np.testing.assert_allclose(pruned.eval(WI, WO), f, rtol=1e-4, atol=1e-5)
    assert pruned.sampler is material.sampler
    for name in ("x.safetensors", "x.h5"):
        nacre.save(material, tmp_path / name)
        np.testing.assert_array_equal(nacre.load(tmp_path / name).eval(WI, WO), f)


def test_permuted_channels_are_a_permuted_code():
    basis = random_hypernetwork()
    permuted = CODE.copy()
    # Of weights p @ CHROMA of the channels, those in another order are of another pair.
    order = [2, 0, 1]
    permuted[4:] = (CODE[4:] @ CHROMA)[order] @ CHROMA.T
    f, g = (basis.decode(code).eval(WI, WO) for code in (CODE, permuted))
    np.testing.assert_allclose(g, f[:, order], rtol=2e-4, atol=1e-6)
    assert not np.allclose(g, f, rtol=1e-2)


@pytest.mark.parametrize("kind", [random_hypernetwork, random_autoencoder])
@pytest.mark.parametrize("size", [30.0, 1e3, 9.9e5])
def test_a_code_far_away_gives_what_is_finite(kind, size):
    random = np.random.default_rng(1)
    basis = kind()
    for code in size * np.sign(random.normal(size=(8, 6))):
        f = basis.decode(code).eval(WI, WO)
        assert np.isfinite(f).all()
        assert (f >= 0).all()
        np.testing.assert_array_equal(basis.decode(code / 3.0).eval(WI, WO), f)


def test_codes_that_are_none_are_refused():
    for code in (np.zeros(5), np.full(6, 1e6), np.full(6, np.nan)):
        with pytest.raises(ValueError, match="6 values"):
            random_hypernetwork().decode(code)


def test_layers_that_do_not_fit_are_refused():
    basis = random_hypernetwork()
    layers = basis.layers | {"channel": basis.layers["trunk"]}
    with pytest.raises(ValueError, match="layer channel"):
        Hypernetwork(random_basis(), **layers)
    auto = random_autoencoder()
    layers = auto.layers | {"expand": auto.layers["contract"]}
    with pytest.raises(ValueError, match="layer expand"):
        Autoencoder(auto.common, **layers, seed=0)
    with pytest.raises(ValueError, match="is no network"):
        Autoencoder(auto.common[:-1], **auto.layers, seed=0)


@pytest.mark.parametrize("kind", [random_hypernetwork, random_autoencoder])
def test_tangents_are_the_derivatives_of_f_r(kind):
    torch = pytest.importorskip("torch", reason="needs the extra 'latent'")
    basis = kind()
    weights = basis.weights(CODE[None])[0]
    tangents = weight_tangents(basis, CODE)
    free = torch.tensor(weights, requires_grad=True)
    seen = torch.from_numpy(INPUTS[:40]).double()
    by_weight = torch.autograd.functional.jacobian(
        lambda w: tensor_reflectance(w[None], seen)[0].log1p(), free
    )
    expected = np.einsum("ncw,kw->knc", by_weight.numpy(), tangents)
    y, found = with_tangents(network_layers(weights), INPUTS[:40].astype(np.float64), tangents)
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-6)  # of float32 weights
    step = 1e-3 * np.eye(6)[2]
    moved = forward(
        INPUTS[:40].astype(np.float64), network_layers(basis.weights((CODE + step)[None])[0])
    )
    np.testing.assert_allclose((moved - y) / 1e-3, found[2], atol=0.02 * np.abs(found[2]).max())


def test_many_networks_at_once_are_each_as_alone():
    torch = pytest.importorskip("torch", reason="needs the extra 'latent'")
    basis = random_hypernetwork()
    codes = np.random.default_rng(5).normal(size=(4, 6))
    weights = torch.from_numpy(basis.weights(codes).astype(np.float32))
    together = tensor_reflectance(weights, torch.from_numpy(INPUTS)).clamp(min=0.0).numpy()
    alone = [basis.decode(code).eval(WI, WO) for code in codes]
    np.testing.assert_allclose(together, alone, rtol=1e-4, atol=1e-5)


def logarithms(material: NeuralBrdf) -> np.ndarray:
    return np.log1p(30.0 * material.eval(WI, WO) * WI[:, 2:])


@pytest.mark.parametrize("kind", [random_hypernetwork, random_autoencoder])
def test_what_a_code_stands_for_leads_to_it(kind):
    basis = kind()
    truth = basis.decode(0.6 * CODE)
    found = basis.decode(basis.refined(PictureErrors(truth), np.zeros(6), 1e-3))
    near, exact, mean = map(logarithms, (found, truth, basis.decode(np.zeros(6))))
    assert np.abs(near - exact).mean() < 0.1 * np.abs(mean - exact).mean()


def test_what_has_no_code_is_refused():
    with pytest.raises(FormatError, match="isotropic"):
        random_hypernetwork().encode(Brushed())
    with pytest.raises(NacreError, match="known at none"):
        random_hypernetwork().encode(MerlBrdf(np.full((3, *GRID.dimensions), -1.0)))
