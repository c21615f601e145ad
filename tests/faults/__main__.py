"""Disturb long commands, all or some of them, and print a table of what came of it.

    python -m tests.faults                              all commands, all faults
    python -m tests.faults fit encode --kills 50        two of them, killed 50 times each
    python -m tests.faults encode --faults kill stop    two kinds of faults
    python -m tests.faults --calls                      calls to the system fail, one by one
    python -m tests.faults --calls space device --points 40 fit view

Problems are printed as they are found. Full and read-only disks need the right to mount; a clock
that goes back needs Debian's libfaketime, calls that fail need gcc. Linux only.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import sys
import tempfile
import time
from pathlib import Path

from tests.faults.calls import KINDS, compiler
from tests.faults.commands import LONG
from tests.faults.faults import FAULTS, MOUNTED, can_mount
from tests.faults.forks import Forks
from tests.faults.points import ALL, Points, fail_calls
from tests.faults.trial import Trial
from tests.faults.writers import WRITERS


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.faults",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    names = f"of {', '.join(LONG)}; with --calls of {', '.join(WRITERS)} (default: all)"
    parser.add_argument("commands", nargs="*", help=names)
    parser.add_argument("--calls", nargs="*", choices=KINDS, help="fail calls of these kinds")
    parser.add_argument("--points", type=int, default=ALL, help=f"calls of each (default: {ALL})")
    parser.add_argument("--faults", nargs="+", choices=FAULTS, default=list(FAULTS))
    parser.add_argument("--kills", type=int, default=50, help="of each command (default: 50)")
    parser.add_argument("--times", type=int, default=6, help="of other faults (default: 6)")
    parser.add_argument("--seed", type=int, default=0, help="of all moments (default: 0)")
    arguments = parser.parse_args()
    if unknown := set(arguments.commands) - set(LONG if arguments.calls is None else WRITERS):
        parser.error(f"no such command is called {', '.join(unknown)}")
    signal.signal(signal.SIGINT, signal.default_int_handler)  # shells ignore it in the background
    if arguments.calls is not None:
        sys.exit(_calls(arguments) > 0)
    bad = 0
    for name in arguments.commands or LONG:
        with tempfile.TemporaryDirectory() as folder, LONG[name].command() as command:
            trial = Trial(LONG[name], command, Path(folder) / "work")
            trial.measure()
            print(
                f"{name}: {trial.seconds:.1f} s of processor time, {trial.changes} changes",
                flush=True,
            )
            for fault in arguments.faults:
                if fault in MOUNTED and not can_mount():
                    print(f"  {fault:10} skipped: may not mount", flush=True)
                    continue
                dice = random.Random(f"{arguments.seed} {name} {fault}")
                before, start = sum(os.times()[2:4]), time.monotonic()
                times = arguments.kills if fault == "kill" else arguments.times
                tally = FAULTS[fault](trial, times, dice)
                cpu, seconds = sum(os.times()[2:4]) - before, time.monotonic() - start
                print(f"  {fault:10} {tally} ({cpu:.0f} s CPU, {seconds:.0f} s)", flush=True)
                for problem in tally.problems:
                    print(f"    {problem}", flush=True)
                bad += len(tally.problems)
    sys.exit(bad > 0)


def _calls(arguments: argparse.Namespace) -> int:
    """Let calls fail; the number of problems."""
    if compiler() is None:
        print("skipped: gcc is absent")
        return 0
    bad, forks = 0, Forks()
    for name in arguments.commands or WRITERS:
        with tempfile.TemporaryDirectory() as folder, WRITERS[name].command() as command:
            trial = Points(WRITERS[name], command, Path(folder) / "work", forks)
            try:
                trial.measure()
            except AssertionError as error:
                print(f"{name}: cannot be tried: {error}", flush=True)
                bad += 1
                continue
            for kind in arguments.calls or KINDS:
                tally = fail_calls(trial, kind, arguments.points)
                print(f"{name} {kind}: {tally}", flush=True)
                for problem in tally.problems:
                    print(f"    {problem}", flush=True)
                bad += len(tally.problems)
    forks.close()
    return bad


if __name__ == "__main__":
    main()
