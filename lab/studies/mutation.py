"""Mutants of the readers, the samplers, the files and the geometry: how many does a test notice?

`python -m lab.studies.mutation --rooms io,sampling --mutants 60 --seed 0`, from the root of the
repository; with what `make test` installs. A first run takes some minutes more: it records which
test runs which line. A run that was stopped goes on, and `--again` tests once more what survived,
which shows what new tests notice.

Mutants are drawn evenly from all that :mod:`lab.studies.mutants.operators` makes of a room. Each
runs in a process of its own, until a test fails: first the tests that run the changed statement,
those of its module and room before others and the quickest first, for 12 seconds at most, then
those that run anything of the file, for 16 seconds in all. Where the change lies within a function,
its code is replaced in a process that has collected all tests; else the module is imported with the
change. No code is kept: formulas are traced and compiled
anew, and none of the rooms has a function that Numba compiles. A test counts as noticing only if it
passes without a mutant, in the same way.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import random
import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from difflib import unified_diff
from itertools import zip_longest
from pathlib import Path
from typing import Any

from lab.studies.mutants.coverage_record import IMPORT, Record
from lab.studies.mutants.operators import Mutant, modules, mutants
from lab.studies.mutants.worker import Imported, Tests, Warm, append

ROOMS = {
    "measured": ["src/nacre/measured"],
    "sampling": ["src/nacre/sampling"],
    "io": ["src/nacre/io"],
    "geometry": ["src/nacre/geometry.py"],
    "numerics": ["src/nacre/numerics"],
    "headers": [
        "src/nacre/neural/file.py",
        "src/nacre/textures/latent_file.py",
        "src/nacre/textures/codecs/codec_file.py",
        "src/nacre/latent/file.py",
        "src/nacre/io/tensors.py",
    ],
}
"""What mutants are drawn from; `io` is without the file of the headers."""
TESTS = [
    *("tests/measured", "tests/sampling", "tests/io", "tests/numerics", "tests/attacks"),
    *("tests/test_geometry.py", "tests/test_formats.py", "tests/test_bad_input.py"),
    *("tests/test_bad_readers.py", "tests/test_written_files.py", "tests/test_writing.py"),
    *("tests/test_array.py", "tests/test_nbytes.py", "tests/test_btf.py"),
    *("tests/contracts/test_materials.py", "tests/contracts/test_samplers.py"),
    *("tests/neural/test_file.py", "tests/neural/test_inputs.py", "tests/latent/test_file.py"),
    *("tests/latent/test_pca.py", "tests/analytic/test_files.py", "tests/runtime/test_store.py"),
    *("tests/analytic/test_power_iteration.py", "tests/metrics/test_physics.py"),
    *("tests/textures/test_latent_file.py", "tests/textures/test_ubo2014.py"),
    "tests/textures/test_compact.py",
    *("tests/textures/test_utia_damage.py", "tests/textures/test_mipmap.py"),
    *("tests/textures/codecs/test_codec_facts.py", "tests/textures/codecs/basis/test_file.py"),
    *("tests/textures/codecs/networks/test_file.py", "tests/cli/test_convert.py"),
    *("tests/textures/codecs/principal/test_file.py", "tests/cli/test_convert_tables.py"),
    *("tests/neural/test_physical.py", "tests/latent/test_picture_errors.py"),
    "tests/analytic/test_picture_fit.py",
    *("tests/standard/test_closures.py", "tests/standard/test_materialx_file.py"),
    *("tests/standard/test_materialx_graphs.py", "tests/standard/test_materialx_surfaces.py"),
    "tests/standard/test_color_spaces.py",
    *("tests/latent/test_lobe_predictor.py", "tests/workflows/test_files.py"),
    *("tests/targets/test_textures.py", "tests/mitsuba/textures/test_sampling.py"),
]
"""Files and folders of the tests that are asked, beside the examples in docstrings."""
ROOT = Path(__file__).resolve().parents[2]

_ALIVE = {"survived", "not run"}
_LINES, _FILE = 12.0, 4.0  # seconds of tests that run the statement, and of others of its file


def main() -> None:
    """Record, draw, test, report."""
    options = _options()
    os.chdir(ROOT)
    os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
    folder: Path = options.output.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    os.environ["NUMBA_CACHE_DIR"] = str(folder / "code")
    record = _recorded(folder)
    results = folder / f"seed-{options.seed}.jsonl"
    known = _results(results)
    drawn = {room: _drawn(room, options) for room in options.rooms}
    waiting = [
        mutant
        for turn in zip_longest(*drawn.values())
        for mutant in turn
        if mutant is not None
        if (row := known.get(_key(mutant))) is None
        or row["status"] == "import"
        or (options.again and row["status"] in _ALIVE)
    ]
    if waiting:
        _Trials(waiting, record, results).run()
    _report(drawn, _results(results), folder / f"seed-{options.seed}")


def _options() -> argparse.Namespace:
    shape = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(
        "python -m lab.studies.mutation", description=__doc__, formatter_class=shape
    )
    rooms = ",".join(ROOMS)
    parser.add_argument("--rooms", default=rooms, help=f"of {rooms} (default: all)")
    parser.add_argument("--mutants", type=int, default=60, help="of each room (default: 60)")
    parser.add_argument("--seed", type=int, default=0, help="of the draw (default: 0)")
    parser.add_argument("--again", action="store_true", help="test what survived once more")
    folder = ROOT / "out" / "studies" / "mutation"
    parser.add_argument("-o", "--output", type=Path, default=folder, help="folder of results")
    options = parser.parse_args()
    options.rooms = options.rooms.split(",")
    return options


def _recorded(folder: Path) -> Record:
    """What the tests cover: in a process of its own, for it imports nacre."""
    sources = sorted({Path(file) for room in ROOMS for file in _files(room)})
    tests = [*_test_files(), *(path for path in sources if ">>> " in path.read_text())]
    place = folder / "record.json"
    missing = Record(place).missing(tests, sources)
    if missing:
        print(f"recording {len(missing)} files of tests", file=sys.stderr, flush=True)
        child = os.fork()
        if not child:
            record = Record(place)
            record.missing(tests, sources)
            record.add(missing, sources)
            os._exit(0)
        if os.waitpid(child, 0)[1]:
            sys.exit("the tests could not be recorded")
    return Record(place)


def _test_files() -> list[Path]:
    files: list[Path] = []
    for name in TESTS:
        path = Path(name)
        files += sorted(path.rglob("test_*.py")) if path.is_dir() else [path]
    return files


def _files(room: str) -> list[str]:
    elsewhere = () if room == "headers" else ROOMS["headers"]
    return [file for file in modules(ROOMS[room], Path()) if file not in elsewhere]


def _drawn(room: str, options: argparse.Namespace) -> list[Mutant]:
    every = [mutant for file in _files(room) for mutant in mutants(file, Path())]
    generator = random.Random(f"{room} {options.seed}")
    generator.shuffle(every)
    return every[: options.mutants]


def _key(mutant: Mutant) -> str:
    """Of the mutant and of the file as it is."""
    source = Path(mutant.file).read_text()
    return hashlib.sha256(f"{source}{mutant}".encode()).hexdigest()[:16]


def _results(path: Path) -> dict[str, dict[str, Any]]:
    """The last word on each mutant."""
    if not path.exists():
        return {}
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    return {row["key"]: row for row in rows}


def _selected(mutant: Mutant, record: Record) -> tuple[Tests, bool]:
    """The tests of a mutant, and whether imports run it."""
    contexts = record.of_lines(mutant.file, mutant.first, mutant.last)
    near = _quickest(mutant.file, contexts, record, _LINES)
    chosen = {node for node, _ in near}
    others = record.of_file(mutant.file) - contexts - chosen
    left = _LINES - sum(seconds for _, seconds in near)
    far = _quickest(mutant.file, others, record, left + _FILE)
    return [*near, *far], IMPORT in contexts


def _quickest(
    file: str, nodes: Iterable[str], record: Record, seconds: float
) -> list[tuple[str, float]]:
    """Tests of the module, then of its room, then others; the quickest first."""
    place = Path(file).relative_to("src/nacre")
    own, room = f"test_{place.stem}.py", f"tests/{place.parent.as_posix()}/"

    def order(node: str) -> tuple[bool, bool, float, str]:
        path = node.partition("::")[0]
        return not path.endswith(own), not path.startswith(room), record.seconds[node], node

    found, total = [], 0.0
    for node in sorted((node for node in nodes if node in record.seconds), key=order):
        total += record.seconds[node]
        if total > seconds:
            break
        found.append((node, record.seconds[node]))
    return found


class _Trials:
    """The tests of mutants, and the file of results."""

    def __init__(self, waiting: Sequence[Mutant], record: Record, results: Path) -> None:
        self._selections = {mutant: _selected(mutant, record) for mutant in waiting}
        self._sources = {mutant.file: Path(mutant.file).read_text() for mutant in waiting}
        self._results = results
        self._healthy: dict[str, bool] = {}

    def run(self) -> None:
        """Replace code where that can be done, in a process that has nacre; import the others."""
        within = [mutant for mutant, (_, at_import) in self._selections.items() if not at_import]
        imported = Imported()
        if within:
            child = os.fork()
            if not child:
                nodes = {node for mutant in within for node, _ in self._selections[mutant][0]}
                files = sorted({node.partition("::")[0] for node in nodes})
                Warm(lambda warm: self._replace(within, warm)).collect(files)
                os._exit(0)
            if os.waitpid(child, 0)[1]:
                sys.exit("the tests could not be collected")
        done = _results(self._results)
        self._healthy.clear()
        for mutant in self._selections:
            if mutant not in within or done.get(_key(mutant), {}).get("status") == "import":
                self._judge(mutant, imported)

    def _replace(self, within: Sequence[Mutant], warm: Warm) -> None:
        for mutant in within:
            self._judge(mutant, warm)

    def _judge(self, mutant: Mutant, way: Imported | Warm) -> None:
        tests = self._selections[mutant][0]
        if not tests:
            self._keep(mutant, "not run", "")
            return
        status, test = way.run(mutant, self._sources[mutant.file], tests)
        noticed = status in {"killed", "timeout"}
        seconds = dict(tests)
        # A module that fails when it is imported fails before any test.
        check = test if test in seconds else tests[0][0]
        if noticed and check not in self._healthy:
            found, _ = way.run(None, "", [(check, seconds[check])])
            self._healthy[check] = found == "survived"
        self._keep(mutant, status if not noticed or self._healthy[check] else "survived", test)

    def _keep(self, mutant: Mutant, status: str, test: str) -> None:
        append(
            self._results, {"key": _key(mutant), "status": status, "test": test} | asdict(mutant)
        )
        print(status, f"{mutant.file}:{mutant.first}", test, file=sys.stderr, flush=True)


def _report(
    drawn: dict[str, list[Mutant]], results: dict[str, dict[str, Any]], place: Path
) -> None:
    """The table by room, and a file of the survivors."""
    lines = [
        "| room | mutants | killed | by time-out | survived | share |",
        "|---|---:|---:|---:|---:|---:|",
    ]
    total: Counter[str] = Counter()
    alive = []
    for room, chosen in drawn.items():
        rows = [results[_key(mutant)] for mutant in chosen if _key(mutant) in results]
        counts = Counter(row["status"] for row in rows)
        total += counts
        lines.append(_line(room, counts))
        alive += [
            (room, mutant, row["status"])
            for mutant in chosen
            if (row := results.get(_key(mutant))) and row["status"] in _ALIVE
        ]
    lines.append(_line("all", total))
    text = "\n".join(lines) + "\n"
    print(text)
    place.with_suffix(".md").write_text(text)
    place.with_suffix(".diff").write_text("\n".join(_difference(*one) for one in alive))
    print(f"survivors: {place.with_suffix('.diff')}")


def _line(room: str, counts: Counter[str]) -> str:
    alive = counts["survived"] + counts["not run"]
    noticed = counts["killed"] + counts["timeout"]
    share = f"{100 * noticed / max(noticed + alive, 1):.0f} %"
    cells = room, noticed + alive, counts["killed"], counts["timeout"], alive, share
    return "| " + " | ".join(map(str, cells)) + " |"


def _difference(room: str, mutant: Mutant, status: str) -> str:
    source = Path(mutant.file).read_text()
    pair = [text.splitlines() for text in (source, mutant.applied(source))]
    body = "\n".join(list(unified_diff(*pair, lineterm="", n=2))[2:])
    return f"### {room}: {mutant.operator}, {status}: {mutant.file}:{mutant.first}\n{body}\n"


if __name__ == "__main__":
    main()
