"""Evaluations a second of every export that is executed here, and bytes of all of them.

A network fitted with the default recipe is compared with the analytic GGX, both written by the same
target and run by the same tool; `brdf.eval` of nacre on one core is the first row. All rows take
turns; figures are medians of the rounds, by the clock on the wall.
`python -m lab.studies.speed.export`.
"""

from __future__ import annotations

import os
import statistics
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

from lab.studies.study import Study, log, prevent_oversubscription

prevent_oversubscription()

from nacre.array import Weights  # noqa: E402  (thread counts must be set before libraries load)
from nacre.brdf import Brdf  # noqa: E402
from nacre.errors import NacreError  # noqa: E402
from nacre.targets import TARGETS  # noqa: E402
from tests.oracles.materials import GGX, material  # noqa: E402
from tests.oracles.pairs import pairs  # noqa: E402
from tests.oracles.runner import RUNNERS, best_rate  # noqa: E402
from tests.oracles.runners.webgl import WebGl  # noqa: E402

_COUNT = 1 << 18
_ON_ONE_CORE = 1 << 16  # pairs, so few that nacre takes no second core
_MATERIALS = "glossy", GGX
_NAME = "material"  # identifier in every output
_NONE = "—"


@dataclass
class Row:
    """A target and what runs it.

    Parameters
    ----------
    files
        What each of the two materials becomes; None where the target does not hold it.
    calls
        What gives evaluations of each a second; none where nothing runs it.
    """

    target: str
    tool: str
    files: Mapping[str, Mapping[str, bytes] | None]
    calls: Mapping[str, Callable[[], float]]
    rates: dict[str, list[float]] = field(default_factory=dict)

    def measure(self) -> None:
        """Take a turn."""
        for name, call in self.calls.items():
            self.rates.setdefault(name, []).append(call() / 1e6)

    def texts(self) -> tuple[str, ...]:
        """Columns of the table."""
        network, ggx = (self.rates.get(name, []) for name in _MATERIALS)
        ratios = [a / b for a, b in zip(network, ggx, strict=False)]
        shown = [_median(values) for values in (network, ggx, ratios)]
        sizes = [_size(self.files.get(name)) for name in _MATERIALS]
        return (f"`{self.target}`", self.tool, *shown, *sizes)


def rows(wi: Weights, wo: Weights) -> list[Row]:
    """What nacre itself does, then every target with each of its runners."""
    few = slice(_ON_ONE_CORE)
    own = {name: partial(_own_rate, material(name), wi[few], wo[few]) for name in _MATERIALS}
    found = [Row("brdf.eval", "nacre, one core", {}, own)]
    for target in TARGETS:
        files = {name: _files(target, material(name)) for name in _MATERIALS}
        idle = [Row(target, _NONE, files, {})]
        found.extend(_executed(target, files, wi, wo) or idle)
    return found


def _executed(
    target: str, files: Mapping[str, Mapping[str, bytes] | None], wi: Weights, wo: Weights
) -> list[Row]:
    found = []
    for tool in RUNNERS:
        runner = RUNNERS[tool]()
        if runner.target != target:
            continue
        if missing := runner.missing():
            found.append(Row(target, f"{runner.title}: {missing} is not installed", files, {}))
            continue
        calls = {
            name: partial(runner.rate, output, _NAME, wi, wo)
            for name, output in files.items()
            if output is not None
        }
        found.append(Row(target, runner.title, files, calls))
    return found


def _files(target: str, brdf: Brdf) -> Mapping[str, bytes] | None:
    try:
        return TARGETS[target]().files(brdf, _NAME)
    except NacreError as error:
        log(f"{target}: {error}")
        return None


def _own_rate(brdf: Brdf, wi: Weights, wo: Weights) -> float:
    return best_rate(lambda: brdf.eval(wi, wo), len(wi))


def _median(values: list[float]) -> str:
    return f"{statistics.median(values):.3g}" if values else _NONE


def _size(files: Mapping[str, bytes] | None) -> str:
    return f"{sum(map(len, files.values())):,}" if files else _NONE


def _frames(rounds: int) -> str:
    """How long pictures of the materials take in WebGL2, as a sentence; empty without a browser."""
    if WebGl().missing():
        return ""
    files = [TARGETS[WebGl.target]().files(material(name), _NAME) for name in _MATERIALS]
    times = [[1e3 * WebGl().frame(each, _NAME) for each in files] for _ in range(rounds)]
    network, ggx = (statistics.median(each) for each in zip(*times, strict=True))
    return (
        f" {WebGl.title}: 512 x 512 pixels under one light take {network:.1f} ms, of GGX {ggx:.1f}."
    )


def main() -> None:
    """Print a Markdown table."""
    study = Study(__doc__, __file__)
    study.add_argument("--rounds", type=int, default=5)
    options = study.options()
    found = rows(*pairs(_COUNT))
    rounds = 1 if options.quick else options.rounds
    for number in range(rounds):
        log(f"round {number + 1}")
        for row in found:
            row.measure()
    head = "target", "run by", "network, million/s", "GGX, million/s", "network / GGX"
    study.table(
        (*head, "bytes of the network", "bytes of GGX"),
        [row.texts() for row in found],
        note=f"{len(os.sched_getaffinity(0))} cores.{_frames(rounds)}",
    )


if __name__ == "__main__":
    main()
