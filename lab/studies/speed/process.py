"""Commands as processes, from start to end, on two cores: alone, and beside a process that is busy.

Every command runs once to compile what it needs, then all take turns, with the busy process and
without; figures are medians of the rounds. With several `--source`, trees of nacre take turns too.
The first row is the interpreter alone. A machine that does other work measures that work: look at
the load that is printed.
`python -m lab.studies.speed.process --rounds 7`.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from lab.studies.study import Study, log, rgl_tables

_ROOT = Path(__file__).resolve().parents[3]


@dataclass
class Row:
    """A command and a tree, with seconds of each round."""

    name: str
    words: Sequence[str]
    source: Path
    wall: dict[bool, list[float]] = field(default_factory=lambda: {False: [], True: []})
    processor: list[float] = field(default_factory=list)

    def run(self) -> tuple[float, float]:
        """Seconds by the clock on the wall, and of processor time."""
        before, began = os.times(), time.perf_counter()
        subprocess.run(
            [sys.executable, *self.words],
            env=os.environ | {"PYTHONPATH": str(self.source)},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            check=True,
        )
        wall, after = time.perf_counter() - began, os.times()
        used = after.children_user + after.children_system
        return wall, used - before.children_user - before.children_system

    def texts(self) -> tuple[str, ...]:
        alone, beside = (statistics.median(self.wall[busy]) for busy in (False, True))
        used = statistics.median(self.processor)
        return self.name, f"{alone:.2f}", f"{used:.2f}", f"{beside:.2f}", f"{beside / alone:.2f}"


@contextmanager
def busy_process() -> Iterator[None]:
    """A process that takes all of a core that it gets, and ends by itself if it is left alone."""
    code = "import time\nwhile time.process_time() < 300.0: pass"
    process = subprocess.Popen([sys.executable, "-c", code])
    try:
        yield
    finally:
        process.kill()
        process.wait()


def main() -> None:
    study = Study(__doc__, __file__)
    study.add_argument("--rounds", type=int, default=7)
    study.add_argument("--cores", type=int, default=2, help="that all processes share (default: 2)")
    study.add_argument("--file", type=Path, help="measured file (default: the first RGL table)")
    about = "folder that has nacre, for several to compare (default: src)"
    study.add_argument("--source", type=Path, action="append", help=about)
    options = study.options()
    if hasattr(os, "sched_setaffinity"):
        cores = sorted(os.sched_getaffinity(0))[: options.cores]
        os.sched_setaffinity(0, cores)
    file = str(options.file or rgl_tables()[0])
    sources = options.source or [_ROOT / "src"]
    with tempfile.TemporaryDirectory() as folder:
        rows = [Row("`python -c pass`", ("-c", "pass"), sources[0])]
        fit = "fit", file, "--force", "-o", str(Path(folder, "fit.safetensors"))
        commands = {
            "--help": ("--help",),
            "info FILE": ("info", file),
            "fit --preset draft FILE": (*fit, "--preset", "draft"),
            "fit FILE": fit,
        }
        for source in sources:
            tree = f" in {source}" if len(sources) > 1 else ""
            for name, words in commands.items():
                at = "-m", "nacre", *words
                rows.append(Row(f"`nacre {name}`{tree}", at, source.resolve()))
        for row in rows:
            row.run()
        for number in range(1 if options.quick else options.rounds):
            log(f"round {number + 1}, load {os.getloadavg()[0]:.1f}")
            for row in rows:
                wall, used = row.run()
                row.wall[False].append(wall)
                row.processor.append(used)
                with busy_process():
                    row.wall[True].append(row.run()[0])
    study.table(
        ("command", "s, alone", "s of processor time", "s, beside a busy process", "times"),
        [row.texts() for row in rows],
        note=f"Load at the end: {os.getloadavg()[0]:.1f}",
    )


if __name__ == "__main__":
    main()
