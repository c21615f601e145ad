"""Materials of every kind: either they are exported, or one line says what to do."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from functools import cache, partial
from typing import Any

import numpy as np
import pytest

import nacre
from nacre.analytic import Ggx
from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.latent import pretrained_hypernetwork, save_code
from nacre.measured import ScatteredBrdf, rgl, utia
from nacre.measured.merl import Resolution, tabulate
from nacre.neural import NeuralBrdf
from nacre.neural.training import initial_layers
from nacre.numerics.mlp import Layer
from nacre.targets import TARGETS, export, identifier
from nacre.targets.source import SourceTarget
from tests.analytic.materials import EXAMPLES
from tests.cli.support import assert_refused, run
from tests.data import require_data
from tests.latent import made
from tests.oracles.pairs import numbers, pairs
from tests.oracles.runner import reference, worst_error
from tests.oracles.runners import slang
from tests.targets.support import needs
from tests.tiers import tiered

GGX = Ggx(name="x", diffuse=(0.2, 0.1, 0.05), specular=(0.04, 0.04, 0.04), roughness=0.3)
CODE = np.linspace(-1.0, 1.0, 32)


def network(*sizes: int, scale: float = 1.0, **settings: Any) -> NeuralBrdf:
    random, layers = np.random.default_rng(0), []
    for i, o in itertools.pairwise(sizes):
        layers.append(Layer(scale * random.normal(size=(i, o)) / i, 0.1 * random.normal(size=o)))
    return NeuralBrdf(layers, **settings)


def changed(change: Callable[[np.ndarray], np.ndarray], **settings: Any) -> NeuralBrdf:
    layers = network(6, 8, 3).layers
    return NeuralBrdf([Layer(change(x.weights), change(x.biases)) for x in layers], **settings)


GATHERED = "tabulated-microfacets", "npf"
"""Models that gather from tables."""

OVERFLOWING = "overflowing"
WRITTEN: Mapping[str, Brdf] = {
    **{identifier(name): brdf for name, brdf in EXAMPLES.items() if name not in GATHERED},
    "neural_code": made.random_basis().decode(CODE[:6]),
    "hypernetwork_code": pretrained_hypernetwork().decode(0.2 * CODE),
    "wide": network(6, 40, 3),
    "one_unit": network(6, 1, 3),
    "no_hidden_layer": network(6, 3),
    "smooth": network(6, 7, 5, 3, inputs="enhanced", activation="squared relu"),
    "half": changed(lambda x: x.astype(np.float16).astype(np.float32), precision="half"),
    "no_weights": changed(np.zeros_like),
    "denormal_weights": changed(lambda x: x * np.float32(1e-40)),
    OVERFLOWING: network(6, 8, 3, scale=1e4),
}
WI, WO = pairs(20_000)


@cache
def library() -> Any:
    """What Slang makes of all of them."""
    needs(slang.Slang().missing())
    files: dict[str, bytes] = {}
    for each, brdf in WRITTEN.items():
        files |= TARGETS["slang"]().files(brdf, each)
    values = {
        f"{each}_{key}": text.replace("{name}", each)
        for each, (key, text) in itertools.product(WRITTEN, slang.VALUES.items())
    }
    first, *others = WRITTEN
    imports = "".join(f"import {each};\n" for each in others)
    return slang.built(files, imports + slang.shader(first, values))


def found(name: str, function: str) -> np.ndarray:
    given = (WO, numbers(len(WO))) if function == "sample" else (WI, WO)
    call = slang.Call(library(), f"{name}_{function}", *given)
    call()
    return call.result


@pytest.mark.slow
@pytest.mark.parametrize("name", WRITTEN)
def test_what_is_written_says_what_numpy_says(name: str) -> None:
    brdf = WRITTEN[name]
    values, density = found(name, "eval")[:, :3], found(name, "pdf")[:, 0]
    assert np.isfinite(values).all()
    if name == OVERFLOWING:
        assert values.max() == np.finfo(np.float32).max
        return
    # Where both directions are nearly level, single precision knows the half vector of some badly.
    level = (WI[:, 2] < 1e-3) & (WO[:, 2] < 1e-3)
    assert worst_error(values[~level], reference(brdf, "eval", WI, WO)[~level]) <= 1.0
    assert worst_error(density, reference(brdf, "pdf", WI, WO)) <= 1.0


@pytest.mark.parametrize("name", WRITTEN)
def test_what_is_drawn_has_the_density_that_it_says(name: str) -> None:
    drawn = found(name, "sample").astype(np.float64)
    assert np.isfinite(drawn).all()
    good = drawn[:, 3] > 0.0
    wi, wo = drawn[good, :3], WO[good].astype(np.float64)
    np.testing.assert_allclose(np.linalg.norm(wi, axis=1), 1.0, atol=1e-5)
    density = WRITTEN[name].pdf(wi / np.linalg.norm(wi, axis=1, keepdims=True), wo)
    np.testing.assert_allclose(drawn[good, 3], density, rtol=1e-3)


def scattered() -> Brdf:
    wi, wo = (w[:500] for w in pairs(10_000))
    return ScatteredBrdf(wi, wo, GGX.eval(wi, wo), "x")


MEASURED: Mapping[str, Callable[[], Brdf]] = {
    "MERL table": lambda: tabulate(GGX, Resolution(18, 9, 9)),
    "RGL table": lambda: rgl.tabulate(GGX),
    "UTIA table": lambda: utia.tabulate(GGX),
    "scattered samples": scattered,
    "PCA code": lambda: made.basis().decode(CODE[:6]),
    **{name: partial(EXAMPLES.get, name) for name in GATHERED},
}
SOURCES = [name for name, target in TARGETS.members() if issubclass(target, SourceTarget)]


@pytest.mark.parametrize("name", MEASURED)
@pytest.mark.parametrize("target", tiered(SOURCES, list(SOURCES)[::3]))
def test_what_is_no_formula_is_refused_in_one_line(target: str, name: str, tmp_path) -> None:
    brdf = MEASURED[name]().replaced(name="felt")
    with pytest.raises(NacreError, match=f"^{target}: felt.*nacre fit") as caught:
        export(brdf, target, f"{tmp_path}/")
    assert "\n" not in str(caught.value)
    assert str(caught.value).count("felt") == 1
    assert not list(tmp_path.iterdir())


def test_a_measured_table_is_refused(tmp_path) -> None:
    brdf = nacre.load(require_data("rgl", "acrylic_felt_green_rgb.bsdf"))
    with pytest.raises(NacreError, match=r"fit a network to it first \(nacre fit\)"):
        export(brdf, "slang", f"{tmp_path}/")


def test_networks_too_wide_for_literals_are_refused_with_what_holds_them() -> None:
    wide = NeuralBrdf(initial_layers((300, 300), 0), name="felt")
    with pytest.raises(
        NacreError, match=r"felt: \d\d,\d{3} weights .*; export it --to c, onnx, pytorch or mdl"
    ):
        TARGETS["slang"]().files(wide, "m")
    assert TARGETS["c"]().files(wide, "m")


def test_the_command_takes_codes(tmp_path, capsys) -> None:
    basis = pretrained_hypernetwork()
    save_code(basis.decode(0.2 * CODE, "silk"), tmp_path / "silk.json")
    given = "export", str(tmp_path / "silk.json"), "--to", "slang", "-o", f"{tmp_path}/"
    assert run(*given, "--basis", "hypernetwork") == 0
    assert "float3 silk_eval(" in (tmp_path / "silk.slang").read_text()
    assert_refused(capsys, "silk.json: is not a neural code", *given)
    assert_refused(capsys, "is a code", *given, "--basis", "hypernetwork", "--depth", "1")
