"""The tests of drawn directions pass what is right and notice each thing that is wrong."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from nacre.analytic import MODELS, AnisotropicGgx, Ggx
from nacre.brdf import Brdf
from tests.oracles.quadrature import integrate
from tests.oracles.runner import Runner
from tests.oracles.sampling import Findings, Reference, inspect, view
from tests.tiers import tiered

BASE = {"diffuse": (0.1, 0.2, 0.3), "specular": (0.9, 0.6, 0.3)}
MATERIALS: dict[str, Brdf] = {
    "diffuse": MODELS["lambert"](diffuse=(0.1, 0.2, 0.3)),
    "glossy": Ggx(**BASE, roughness=0.3),
    "near mirror": Ggx(**BASE, roughness=0.002),
    "anisotropic": AnisotropicGgx(**BASE, roughness_x=0.05, roughness_y=0.4, angle=0.5),
}
Change = Callable[[np.ndarray], np.ndarray]


class NumpyRunner(Runner):
    """A material itself, drawing what another would and with changes if asked to."""

    target = title = "numpy"

    def __init__(self, material: Brdf, drawn: Brdf, **changes: Change) -> None:
        self.material, self.drawn, self.changes = material, drawn, changes

    def missing(self) -> str | None:
        return None

    def rate(self, *_: object) -> float:
        raise NotImplementedError

    def run(self, files, name, function, a, b):  # type: ignore[no-untyped-def]
        if function == "sample":
            wi, pdf = self.drawn.sample(a, b)
            there = pdf > 0.0
            pdf[there] = self.material.pdf(wi[there], a[there])
            found = np.c_[wi, pdf]
        else:
            found = getattr(self.material, function)(a, b)
        return self.changes.get(function, lambda x: x)(found)


def found(material: Brdf, degrees: float, drawn: Brdf | None = None, **changes: Change) -> Findings:
    reference = Reference.of(material, view(degrees))
    (findings,) = inspect(NumpyRunner(material, drawn or material, **changes), {}, "m", [reference])
    return findings


@pytest.mark.parametrize("degrees", tiered([0.0, 75.0], [75.0]))
@pytest.mark.parametrize("name", MATERIALS)
def test_what_a_material_draws_passes(name: str, degrees: float) -> None:
    findings = found(MATERIALS[name], degrees)
    assert findings.passed, findings


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("glossy", Ggx(**BASE, roughness=0.31)),
        ("near mirror", Ggx(**BASE, roughness=0.00207)),
        (
            "anisotropic",
            AnisotropicGgx(**BASE, roughness_x=0.05, roughness_y=0.4, angle=0.51),
        ),
    ],
)
def test_directions_of_another_lobe_are_noticed(name: str, wrong: Brdf) -> None:
    findings = found(MATERIALS[name], 45.0, wrong)
    assert findings.p_value < 1e-5
    assert not findings.passed


def scaled(column: slice | int, factor: float) -> Change:
    def change(values: np.ndarray) -> np.ndarray:
        values = values.copy()
        values[:, column] *= factor
        return values

    return change


def test_each_kind_of_error_is_noticed() -> None:
    glossy = MATERIALS["glossy"]
    findings = found(glossy, 45.0, sample=scaled(3, 1.01))
    assert findings.density_error > 1.0
    assert not findings.passed
    findings = found(glossy, 45.0, sample=scaled(slice(0, 3), 1.0001))
    assert findings.density_error == pytest.approx(10.0, rel=0.1)
    assert not findings.passed
    findings = found(glossy, 45.0, eval=scaled(slice(0, 3), 1.02))
    assert findings.weight_error > 1.0
    assert not findings.passed


def test_a_direction_that_a_target_loses_is_noticed() -> None:
    def without(values: np.ndarray) -> np.ndarray:
        values = values.copy()
        values[::100, 3] = 0.0
        return values

    findings = found(MATERIALS["glossy"], 45.0, sample=without)
    assert findings.density_error > 1.0
    assert not findings.passed


@pytest.mark.parametrize("function", ["sample", "eval"])
@pytest.mark.parametrize("wrong", [math.nan, math.inf])
def test_what_is_no_number_is_noticed(function: str, wrong: float) -> None:
    def spoiled(values: np.ndarray) -> np.ndarray:
        values = values.copy()
        values[7, -1] = wrong
        return values

    findings = found(MATERIALS["diffuse"], 45.0, **{function: spoiled})
    assert not findings.passed
    assert math.isinf(findings.weight_error)


def test_integrals_are_those_of_closed_forms() -> None:
    lambert = MATERIALS["diffuse"]
    reference = Reference.of(lambert, view(30.0))
    np.testing.assert_allclose(reference.albedo, [0.1, 0.2, 0.3], rtol=1e-9)
    # The cosine's density integrates to the difference of squared sines, times that of azimuths.
    ring = np.diff(1.0 - (1.0 - reference.depth) ** 2)
    expected = ring[:, None] * np.diff(reference.azimuth, axis=1) / (2.0 * math.pi)
    np.testing.assert_allclose(reference.probability, expected, atol=1e-9)

    def peak(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return (1.0 / ((x * x + 1e-6) * (1.0 + y * y)))[:, None]

    values, errors = integrate(peak, np.array([[-1.0, 2.0, 0.0, 1.0]]))
    exact = (math.atan(2000.0) + math.atan(1000.0)) * 1000.0 * math.pi / 4.0
    assert abs(values[0, 0] - exact) <= errors[0, 0] < 1e-3 * exact
