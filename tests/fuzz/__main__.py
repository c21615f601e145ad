"""Fuzz the readers of files, all or some of them: those of formats, and tests.fuzz.readers.

    python -m tests.fuzz                          every reader in turn, a minute each
    python -m tests.fuzz MERL .h5 --seconds 600   two of them, ten minutes each
    python -m tests.fuzz MERL --input FILE        try a saved input again
    python -m tests.fuzz --blind 100              100 inputs each, without atheris

Inputs that fail are kept in out/fuzz/<format>/failure-* with the error beside them, one for each
place that fails; those that end the process (crash, time, memory) in crash-*. The corpus is kept
too, so that a further run goes on from there. Needs Linux and atheris (make fuzz).
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import re
import subprocess
import sys
import time
from pathlib import Path
from random import Random

from tests.fuzz.cases import cases
from tests.fuzz.target import Figures, target, working_folder
from tests.specimens import mutated

_STATISTIC = re.compile(r"^stat::(\w+):\s+(\d+)$", re.MULTILINE)
_COVERAGE = re.compile(r"cov: (\d+) ft: (\d+)")
_HEAD = """| reader | s of CPU | executions | read | cov, ft | failures | MiB | resident |
|---|---:|---:|---:|---:|---:|---:|---:|"""
_REPOSITORY = Path(__file__).resolve().parents[2]


def chosen(words: list[str]) -> list[str]:
    """Names that are a word or hold it, or of formats that end in it; all if there is no word."""

    def fits(name: str, word: str) -> bool:
        word = word.lower()
        return word in name.lower() or f".{word.removeprefix('.')}" in cases()[name][0].extensions

    exact = {name for name in cases() if name.lower() in map(str.lower, words)}
    rest = [w for w in words if w.lower() not in {name.lower() for name in exact}]
    unknown = [w for w in rest if not any(fits(name, w) for name in cases())]
    if unknown:
        raise SystemExit(f"nothing is called {unknown[0]!r} (known: {', '.join(cases())})")
    return [n for n in cases() if n in exact or any(fits(n, w) for w in rest) or not words]


def fuzz(name: str, seconds: int, output: Path) -> tuple[str, bool]:
    """Run the fuzzer until the time is over, again when it ends; a line of figures, and if bad."""
    output.mkdir(parents=True, exist_ok=True)
    for old in [*output.glob("failure-*"), *output.glob("crash-*")]:
        old.unlink()
    end = time.monotonic() + seconds
    executed, deaths, coverage, figures = 0, 0, ("0", "0"), Figures()
    with (output / "log.txt").open("w") as log, working_folder() as where:
        while (left := int(end - time.monotonic())) > 0 or not executed:
            (output / "figures.json").unlink(missing_ok=True)
            command = [sys.executable, "-m", "tests.fuzz.engine", name, str(output), where]
            process = subprocess.run(
                [*command, str(max(left, 1))],
                cwd=_REPOSITORY,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
                errors="replace",
                check=False,
            )
            log.write(process.stderr)
            deaths += process.returncode != 0
            statistics = dict(_STATISTIC.findall(process.stderr))
            coverage = ([*_COVERAGE.findall(process.stderr), coverage])[-2:][0]
            if not (output / "figures.json").exists():
                raise SystemExit(f"{name}: the fuzzer does not start; see {output}/log.txt")
            last = Figures(**json.loads((output / "figures.json").read_text()))
            executed += int(statistics.get("number_of_executed_units", last.executed))
            figures.loaded += last.loaded
            figures.seconds += last.seconds
            figures.peak = max(figures.peak, last.peak)
            figures.resident = max(figures.resident, last.resident)
    failures = kept_in(output)
    line = row(name, figures, executed, f"{coverage[0]}, {coverage[1]}", len(failures))
    kept = [f"    python -m tests.fuzz {name!r} --input {path}" for path in failures]
    if deaths:
        kept.append(f"    the process died {deaths} times, see {output}/log.txt")
    return "\n".join([line, *kept]), bool(kept)


def blind(name: str, count: int, output: Path) -> tuple[str, bool]:
    """Try files damaged at random, without the guidance of coverage; as :func:`fuzz`."""
    output.mkdir(parents=True, exist_ok=True)
    entry, specimen = cases()[name]
    random, start = Random(0), time.process_time()
    with target(entry, specimen, output) as test:
        for _ in range(count):
            content = random.choice(specimen.files())
            test(random.choice((mutated, specimen.rebuild))(content, random))
        test.write_figures()
    test.figures.seconds = time.process_time() - start
    failures = kept_in(output)
    return row(name, test.figures, count, "", len(failures)), bool(failures)


def kept_in(output: Path) -> list[Path]:
    """Inputs that failed."""
    return sorted(p for p in output.iterdir() if re.match(r"(failure|crash)-[\w-]+$", p.name))


def row(name: str, figures: Figures, executed: int, coverage: str, failures: int) -> str:
    """A row of a table of Markdown, whose head is :data:`_HEAD`."""
    cells = (
        f"{figures.seconds:.0f}",
        f"{executed:,}",
        f"{figures.loaded:,}",
        coverage,
        str(failures),
    )
    memory = f"{figures.peak / 2**20:.1f}", str(figures.resident)
    return f"| {' | '.join((name, *cells, *memory))} |"


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.fuzz",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("formats", nargs="*", help="name of a reader or part of it, or an ending")
    parser.add_argument("--seconds", type=int, default=60, help="for each reader (default: 60)")
    parser.add_argument("--output", type=Path, default=Path("out/fuzz"), help="default: out/fuzz")
    parser.add_argument("--input", type=Path, help="a file to try once, without the fuzzer")
    parser.add_argument("--blind", type=int, help="so many inputs each, without atheris")
    arguments = parser.parse_args()
    names = chosen(arguments.formats)
    if arguments.input:
        if len(names) != 1:
            parser.error("--input needs exactly one reader")
        if not arguments.input.is_file():
            parser.error(f"--input: {arguments.input} is not a file")
        with target(*cases()[names[0]], arguments.output) as test:
            test.check(arguments.input.read_bytes())
        print("no failure")
        return
    if arguments.blind is None and importlib.util.find_spec("atheris") is None:
        raise SystemExit("fuzzing needs atheris: make fuzz")
    bad = False
    print(_HEAD, flush=True)
    for name in names:
        folder = arguments.output.resolve() / re.sub(r"\W+", "-", name).strip("-").lower()
        if arguments.blind is None:
            line, failed = fuzz(name, arguments.seconds, folder)
        else:
            line, failed = blind(name, arguments.blind, folder)
        print(line, flush=True)
        bad |= failed
    sys.exit(bad)


if __name__ == "__main__":
    main()
