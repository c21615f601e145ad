"""Every export that can be executed here, against NumPy in double precision."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import pytest

from nacre.array import Floats, Weights
from nacre.targets import TARGETS, identifier
from tests.oracles.materials import MATERIALS, material
from tests.oracles.pairs import numbers, pairs
from tests.oracles.runner import FEW, RUNNERS, reference, worst_error
from tests.oracles.sampling import Reference, density_error, inspect, view
from tests.targets.support import runner
from tests.tiers import tiered

_PAIRS = 100_000  # of which the last are of special kinds; `tests.oracles.errors` has a million


@cache
def expected(name: str, function: str) -> Floats:
    return reference(material(name), function, *directions())


@cache
def directions() -> tuple[Weights, Weights]:
    return pairs(_PAIRS)


@cache
def exported(target: str, name: str) -> Mapping[str, bytes]:
    return TARGETS[target]().files(material(name), identifier(name))


def having(*functions: str) -> list[tuple[str, str, str]]:
    """Runners, which of these functions their targets have, and materials."""
    return [
        (tool, function, name)
        for tool, each in RUNNERS.items()
        for function in functions
        if function in each.functions
        for name in each.materials
    ]


def drawn() -> list[tuple[str, str, str]]:
    """Of the browser, which is slow, one material for each way to sample, and the sharpest."""
    few = {*FEW, "diffuse", "near mirror"}
    return [one for one in having("sample") if one[2] in few or "web" not in one[0]]


def always(case: tuple[str, str, str]) -> bool:
    """One material for each runner and function; all ways to sample where it takes no time."""
    tool, _, name = case
    return name == FEW[0] or name not in MATERIALS or (tool == "c" and name in FEW)


@cache
def views(name: str) -> list[Reference]:
    return [Reference.of(material(name), view(degrees)) for degrees in (0.0, 45.0, 80.0)]


@pytest.mark.parametrize(("tool", "function", "name"), tiered(having("eval", "pdf"), always))
def test_exports_say_what_numpy_says(tool: str, function: str, name: str) -> None:
    run = runner(tool)
    found = run.run(exported(run.target, name), identifier(name), function, *directions())
    assert worst_error(found, expected(name, function)) <= 1.0


@pytest.mark.parametrize(("tool", "function", "name"), tiered(drawn(), always))
def test_exports_draw_what_numpy_would(tool: str, function: str, name: str) -> None:
    run = runner(tool)
    files = exported(run.target, name), identifier(name)
    wo, u = directions()[1], numbers(_PAIRS)
    drawn = run.run(*files, function, wo, u)
    assert density_error(material(name), drawn, wo) <= 1.0
    for findings in inspect(run, *files, views(name), 1 << 16):
        assert findings.passed, findings
