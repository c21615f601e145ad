"""The promises of every reflectance and sampler, on those of the lab."""

from __future__ import annotations

from types import ModuleType

import pytest

from nacre.brdf import Brdf
from nacre_lab.reproduce.extracted import ExtractedMicrofacets, NormalSampler
from tests.analytic.materials import EXAMPLES, TABLES
from tests.contracts import test_materials, test_samplers
from tests.contracts.test_samplers import sampled

FEW = {
    "material": ExtractedMicrofacets(EXAMPLES["ggx"]),
    "sampler": sampled(NormalSampler(TABLES["distribution"])),
}


def _promises(module: ModuleType) -> dict[str, object]:
    """The tests of a module of contracts that take a reflectance."""
    return {
        name: test
        for name, test in vars(module).items()
        if name.startswith("test_")
        and "brdf" in test.__code__.co_varnames[: test.__code__.co_argcount]
    }


class TestMaterial:
    """Of a reflectance."""

    @pytest.fixture
    def brdf(self) -> Brdf:
        return FEW["material"]


class TestSampler:
    """Of a sampler."""

    @pytest.fixture
    def brdf(self) -> Brdf:
        return FEW["sampler"]


for _case, _module in ((TestMaterial, test_materials), (TestSampler, test_samplers)):
    for _name, _test in _promises(_module).items():
        setattr(_case, _name, staticmethod(_test))
