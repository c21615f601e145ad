"""Ctrl-C and SIGTERM wait for the ends of blocks."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import pytest

from nacre.runtime.interrupts import Terminated, terminable, uninterrupted


@pytest.mark.parametrize(
    ("number", "kind"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, Terminated)]
)
def test_a_signal_waits_for_the_end_of_a_block(number: int, kind: type[BaseException]) -> None:
    done = []

    def block() -> None:
        with uninterrupted():
            os.kill(os.getpid(), number)
            done.append("inside")
        done.append("behind")

    with pytest.raises(kind) as caught, terminable():
        block()
    assert done == ["inside"]
    assert caught.type is kind


def test_a_second_sigterm_lets_the_first_be_tidied_up() -> None:
    done = []

    def stopped() -> None:
        try:
            os.kill(os.getpid(), signal.SIGTERM)
        finally:
            os.kill(os.getpid(), signal.SIGTERM)
            done.append("tidy")

    with pytest.raises(Terminated), terminable():
        stopped()
    assert done == ["tidy"]
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


def test_outside_of_commands_sigterm_ends_the_process_when_a_block_is_over() -> None:
    script = """
import os, signal
from nacre.runtime.interrupts import uninterrupted
with uninterrupted():
    os.kill(os.getpid(), signal.SIGTERM)
    print("inside", flush=True)
print("behind", flush=True)
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.returncode == -signal.SIGTERM
    assert done.stdout == "inside\n"
