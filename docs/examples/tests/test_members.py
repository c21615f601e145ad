"""The members of the package keep nacre's contracts: `python -m pytest tests`."""

from __future__ import annotations

from nacre_example.codec import CosineCodec
from nacre_example.format import FORMAT, PolarBrdf, tabulate
from nacre_example.model import Minnaert
from nacre_example.sampler import PowerCosine
from nacre_example.target import JavaScriptTarget

from nacre.testing import (
    check_brdf,
    check_codec,
    check_format,
    check_model,
    check_sampler,
    check_target,
    parametrize,
)


def table() -> PolarBrdf:
    """A table of a material whose formula is known."""
    return PolarBrdf(tabulate(Minnaert(diffuse=(0.5, 0.3, 0.2), k=1.4)), name="table")


@parametrize(
    check_model(Minnaert, {"diffuse": (0.8, 0.5, 0.3), "k": 0.6}),
    expected_failures={"soundness: energy": "for k below 1 the rim is brighter than the light"},
)
def test_model(check) -> None:
    """The analytic model."""
    check()


@parametrize(check_sampler(PowerCosine(3.0)))
def test_sampler(check) -> None:
    """The sampler."""
    check()


@parametrize(check_format(FORMAT))
def test_format(check) -> None:
    """The file format."""
    check()


@parametrize(check_brdf(table))
def test_table(check) -> None:
    """What the format reads."""
    check()


@parametrize(check_codec(CosineCodec))
def test_codec(check) -> None:
    """The texture codec."""
    check()


@parametrize(check_target(JavaScriptTarget))
def test_target(check) -> None:
    """The export target."""
    check()
