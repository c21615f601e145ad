"""How far every executed export is from NumPy, over all materials of the comparison.

For each tool: the largest error of `eval` and of `pdf` at a million pairs, as a fraction of what
the comparison allows (5e-4 of |reference| plus 1e-3); of what the target draws, the smallest p of
chi-square tests at three views and the largest error of the mean of f cos / pdf, as a fraction of
five standard errors. `python -m lab.studies.parity.errors`.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

from lab.studies.study import Study, log
from nacre.array import Floats
from nacre.errors import NacreError
from nacre.targets import TARGETS, identifier
from tests.oracles.materials import MATERIALS, material
from tests.oracles.pairs import COUNT, pairs
from tests.oracles.runner import RUNNERS, Runner, reference, worst_error
from tests.oracles.sampling import Findings, Reference, inspect, view

_VIEWS = 0.0, 45.0, 80.0  # degrees
_DRAWN = 1 << 17  # samples a view
_NONE = "—"


def row(runner: Runner, names: Sequence[str], count: int) -> tuple[str, ...]:
    """What was found of a tool, as columns of the table."""
    missing = runner.missing()
    if missing:
        return (f"`{runner.target}`", f"{runner.title}: needs {missing}", *[_NONE] * 4)
    errors: dict[str, list[float]] = {"eval": [], "pdf": []}
    findings: list[Findings] = []
    for name in names:
        brdf = material(name)
        files = TARGETS[runner.target]().files(brdf, identifier(name)), identifier(name)
        for function, found in errors.items():
            if function in runner.functions:
                values = runner.run(*files, function, *pairs(count))
                found.append(worst_error(values, _expected(name, function, count)))
        if "sample" in runner.functions:
            findings.extend(inspect(runner, *files, _views(name), _DRAWN))
    shown = [f"{max(found):.3f}" if found else _NONE for found in errors.values()]
    if not findings:
        return (f"`{runner.target}`", runner.title, *shown, _NONE, _NONE)
    p_value = min(each.p_value for each in findings)
    weight = max(each.weight_error for each in findings)
    return (f"`{runner.target}`", runner.title, *shown, f"{p_value:.2g}", f"{weight:.2f}")


@cache
def _expected(name: str, function: str, count: int) -> Floats:
    return reference(material(name), function, *pairs(count))


@cache
def _views(name: str) -> list[Reference]:
    return [Reference.of(material(name), view(degrees)) for degrees in _VIEWS]


def main() -> None:
    """Print a Markdown table."""
    study = Study(__doc__, __file__)
    options = study.options()
    names = study.few(MATERIALS)
    rows = []
    for tool in RUNNERS:
        log(tool)
        try:
            rows.append(row(RUNNERS[tool](), names, COUNT // 20 if options.quick else COUNT))
        except (NacreError, RuntimeError) as error:
            log(f"{tool}: {error}")
    head = "target", "run by", "eval", "pdf", "smallest p of draws", "weight"
    count = len(rows) and len(names) * len(_VIEWS)
    study.table(head, rows, note=f"{len(names)} materials; {count} chi-square tests a row.")


if __name__ == "__main__":
    main()
