"""Fuzz the readers of files, all or some of them.

    python -m tests.fuzz                          every reader in turn, a minute each
    python -m tests.fuzz MERL .h5 --seconds 600   two of them, ten minutes each
    python -m tests.fuzz MERL --input FILE        try a saved input again

Inputs that fail are kept in out/fuzz/<format>/failure-* with the error beside them, one for each
place that fails; those that end the process (crash, time, memory) in crash-*. The corpus is kept
too, so that a further run goes on from there. Needs Linux and atheris: pip install -e '.[fuzz]'.
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

from nacre.io.format import Format
from tests.fuzz.target import Figures, target, working_folder
from tests.specimens import SPECIMENS, file_formats

_STATISTIC = re.compile(r"^stat::(\w+):\s+(\d+)$", re.MULTILINE)
_COVERAGE = re.compile(r"cov: (\d+) ft: (\d+)")
_REPOSITORY = Path(__file__).resolve().parents[2]


def chosen(words: list[str]) -> list[Format]:
    """Formats whose name holds a word, or that end in it; all if there is none."""

    def fits(entry: Format, word: str) -> bool:
        word = word.lower()
        return word in entry.name.lower() or f".{word.removeprefix('.')}" in entry.extensions

    exact = [e for e in file_formats() if e.name.lower() in map(str.lower, words)]
    rest = [w for w in words if w.lower() not in {e.name.lower() for e in exact}]
    found = [e for e in file_formats() if e in exact or any(fits(e, w) for w in rest) or not words]
    unknown = [w for w in rest if not any(fits(e, w) for e in file_formats())]
    if unknown:
        raise SystemExit(f"no format is called {unknown[0]!r} (known: {', '.join(SPECIMENS)})")
    return found


def fuzz(entry: Format, seconds: int, output: Path) -> tuple[str, bool]:
    """Run the fuzzer until the time is over, again when it ends; a line of figures, and if bad."""
    output.mkdir(parents=True, exist_ok=True)
    for old in [*output.glob("failure-*"), *output.glob("crash-*")]:
        old.unlink()
    end = time.monotonic() + seconds
    executed, deaths, coverage, figures = 0, 0, ("0", "0"), Figures()
    with (output / "log.txt").open("w") as log, working_folder() as where:
        while (left := int(end - time.monotonic())) > 0 or not executed:
            (output / "figures.json").unlink(missing_ok=True)
            command = [sys.executable, "-m", "tests.fuzz.engine", entry.name, str(output), where]
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
                raise SystemExit(f"{entry.name}: the fuzzer does not start; see {output}/log.txt")
            last = Figures(**json.loads((output / "figures.json").read_text()))
            executed += int(statistics.get("number_of_executed_units", last.executed))
            figures.loaded += last.loaded
            figures.peak = max(figures.peak, last.peak)
            figures.resident = max(figures.resident, last.resident)
    failures = sorted(p for p in output.iterdir() if re.match(r"(failure|crash)-[\w-]+$", p.name))
    line = (
        f"{entry.name:26} {executed:9,} runs  {figures.loaded:8,} loaded  "
        f"coverage {coverage[0]:>5}  features {coverage[1]:>6}  failures {len(failures):2}  "
        f"peak {figures.peak / 2**20:6.1f} MiB allocated, {figures.resident:4} MiB resident"
    )
    kept = [f"    python -m tests.fuzz {entry.name!r} --input {path}" for path in failures]
    if deaths:
        kept.append(f"    the process died {deaths} times, see {output}/log.txt")
    return "\n".join([line, *kept]), bool(kept)


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.fuzz",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("formats", nargs="*", help="name of a format or part of it, or an ending")
    parser.add_argument("--seconds", type=int, default=60, help="for each format (default: 60)")
    parser.add_argument("--output", type=Path, default=Path("out/fuzz"), help="default: out/fuzz")
    parser.add_argument("--input", type=Path, help="a file to try once, without the fuzzer")
    arguments = parser.parse_args()
    entries = chosen(arguments.formats)
    if arguments.input:
        if len(entries) != 1:
            parser.error("--input needs exactly one format")
        if not arguments.input.is_file():
            parser.error(f"--input: {arguments.input} is not a file")
        with target(entries[0], SPECIMENS[entries[0].name], arguments.output) as test:
            test.check(arguments.input.read_bytes())
        print("no failure")
        return
    if importlib.util.find_spec("atheris") is None:
        raise SystemExit("fuzzing needs atheris: pip install -e '.[fuzz]'")
    bad = False
    for entry in entries:
        folder = re.sub(r"\W+", "-", entry.name).strip("-").lower()
        line, failed = fuzz(entry, arguments.seconds, arguments.output.resolve() / folder)
        print(line, flush=True)
        bad |= failed
    sys.exit(bad)


if __name__ == "__main__":
    main()
