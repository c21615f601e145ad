"""The public contracts: broken members of each family are found, and nacre's own pass."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nacre.analytic import MODELS
from nacre.analytic.lambert import Lambert
from nacre.brdf import CosineSampler
from nacre.errors import NacreError
from nacre.formats import FORMATS
from nacre.sampling import BlinnPhongMixture
from nacre.targets import TARGETS
from nacre.testing import (
    Check,
    check_brdf,
    check_codec,
    check_format,
    check_model,
    check_sampler,
    check_target,
    parametrize,
)
from nacre.textures.codecs import PUBLISHED, load_codec
from tests.tiers import tiered

GGX = MODELS["ggx"]
RED = {"diffuse": (0.3, 0.2, 0.1), "specular": (0.3, 0.3, 0.3), "roughness": 0.4}


def failing(checks: Iterable[Check]) -> set[str]:
    """Names of the checks that fail."""
    found = set()
    for name, check in checks:
        try:
            check()
        except AssertionError:
            found.add(name)
    return found


@pytest.mark.parametrize("name", tiered(["lambert", "ggx", "sgd", "cook-torrance"], ["lambert"]))
def test_models_pass(name: str) -> None:
    properties = ["finite", "positive", "isotropy", "chi-square"]
    assert failing(check_model(MODELS[name], properties=properties)) == set()


def test_a_model_with_a_fault_is_found() -> None:
    class Dark(Lambert):
        @staticmethod
        def formula(values: Any, wi: Any, wo: Any) -> Any:
            red, green, blue = Lambert.formula(values, wi, wo)
            return red, green * (wi[0] - wi[0]) / (wi[0] - wi[0]), blue

    with np.errstate(all="ignore"):
        found = failing(check_model(Dark, properties=["finite"]))
    assert {
        "all of where fits start gives finite values",
        "values are finite and non negative colors",
        "soundness: finite",
    } <= found


def test_a_reflectance_that_claims_too_much_is_found() -> None:
    class Claims(GGX):  # type: ignore[misc, valid-type]
        isotropy_known = True

        def eval_components(self, wi: Any, wo: Any) -> Any:
            return tuple(c * (1.0 + 0.5 * wi[0] * wo[0]) for c in super().eval_components(wi, wo))

    found = failing(check_brdf(lambda: Claims(**RED), properties=["isotropy", "positive"]))
    assert found == {"isotropy is what it says", "soundness: isotropy"}


def test_samplers_pass_and_a_wrong_density_is_found() -> None:
    class Wrong(BlinnPhongMixture):
        def pdf_components(self, wi: Any, wo: Any) -> Any:
            return super().pdf_components(wi, wo) * (1.0 + 0.2 * wi[0])

    assert failing(check_sampler(CosineSampler)) == set()
    assert failing(check_sampler(BlinnPhongMixture(0.5, 50.0))) == set()
    found = failing(check_sampler(Wrong(0.5, 50.0)))
    assert "samples have the density that is said" in found


@pytest.mark.parametrize("name", tiered(["UTIA", "RGL", "SSDD", "Zemax BSDF"], ["UTIA"]))
def test_formats_pass(name: str) -> None:
    checks = check_format(FORMATS[name], tolerance=0.3)
    assert failing(checks) == set()


def test_a_format_with_faults_is_found() -> None:
    utia = FORMATS["UTIA"]

    def careless(path: Path) -> Any:
        if path.exists() and 0 < path.stat().st_size < 1 << 18:
            raise ValueError("too short")
        return utia.load(path)

    found = failing(check_format(replace(utia, load=careless), tolerance=0.3))
    assert found == {"a file cut short is refused or harmless", "what is no file is refused"}


def test_codecs_pass_and_one_that_mixes_texels_is_found() -> None:
    codec = load_codec(PUBLISHED)

    class Mixing(type(codec)):  # type: ignore[misc]
        def decoder(self, wi: Any, wo: Any) -> Any:
            decode = super().decoder(wi, wo)
            return lambda codes: decode(codes) + decode(codes).mean(axis=0)

    assert failing(check_codec(codec)) == set()
    mixing = object.__new__(Mixing)
    vars(mixing).update(vars(codec))
    assert "texels do not depend on others" in failing(check_codec(mixing))


@pytest.mark.parametrize("name", tiered(["glsl", "c", "npy", "onnx", "gltf"], ["glsl", "npy"]))
def test_targets_pass(name: str) -> None:
    assert failing(check_target(TARGETS[name])) == set()


def test_a_target_that_trusts_names_is_found() -> None:
    class Trusting(TARGETS["glsl"]):  # type: ignore[misc]
        def files(self, material: Any, name: str) -> Any:
            return {"out.glsl": f"// {material.name}".encode()}

    assert failing(check_target(Trusting)) >= {
        "files are named after the material",
        "a hostile name does not get into the code",
    }


@parametrize(
    [("holds", lambda: None), ("breaks", lambda: pytest.fail("no"))],
    expected_failures={"breaks": "it is made to"},
)
def test_checks_become_tests(check: Any, request: pytest.FixtureRequest) -> None:
    try:
        check()
    except pytest.fail.Exception as error:
        raise AssertionError from error
    assert request.node.callspec.id == "holds"


def test_a_failure_that_is_expected_of_no_check_is_refused() -> None:
    with pytest.raises(NacreError, match="hold: is not a check; did you mean holds"):
        parametrize([("holds", lambda: None)], expected_failures={"hold": "why"})


def test_pytest_is_imported_when_it_is_asked_for() -> None:
    code = "import sys, nacre.testing; sys.exit('pytest' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
