"""Progress on standard error, on a terminal and elsewhere."""

from __future__ import annotations

import io
import re
import time

import pytest
from rich.console import Console

import nacre
from nacre.cli import display as module
from nacre.cli import report
from nacre.cli.display import Display
from nacre.cli.fitting import RunWatcher
from nacre.cli.session import begin
from tests.cli.support import run
from tests.reflectances import Glossy


class Terminal(io.StringIO):
    """A file that says it is one."""

    def isatty(self) -> bool:
        return True


def screen(*, terminal: bool) -> Console:
    file = Terminal() if terminal else io.StringIO()
    return Console(file=file, force_terminal=terminal, width=120, color_system=None)


def printed(console: Console) -> str:
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def until(console: Console, words: str) -> str:
    """What is printed as soon as that has the words in it."""
    end = time.monotonic() + 20.0
    while words not in printed(console):
        assert time.monotonic() < end, printed(console)
        time.sleep(0.02)
    return printed(console)


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr(module, "DELAY", 0.05)
    monkeypatch.setattr(module, "EVERY", 0.2)


def test_plain_lines_come_now_and_then_where_there_is_no_terminal():
    console = screen(terminal=False)
    with Display("nacre fit", console) as display:
        line = display.add("gold")
        line("reading", 0, 1)
        line("training", 3, 100, "loss 0.1")
        began = time.monotonic()
        until(console, "gold: training 3/100, loss 0.1\n")
        line("training", 50, 100, "loss 0.05")
        text = until(console, "gold: training 50/100, loss 0.05\n")
        lines = (time.monotonic() - began) / module.EVERY + 1.0
    assert "reading" not in text
    assert 2 <= text.count("\n") <= lines


def test_plain_lines_stay_plain_where_colors_are_forced(monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    console = Console(file=io.StringIO(), width=120)
    assert console.is_terminal
    with Display("nacre fit", console):
        assert until(console, "starting\n") == "nacre fit: starting\n"


@pytest.mark.parametrize("terminal", [False, True])
def test_nothing_is_shown_beside_a_question(terminal):
    console = screen(terminal=terminal)
    with Display("nacre download", console) as display:
        with display.hidden():
            display.add("gold")("downloading", 1, 100)
            time.sleep(0.3)
            assert "gold" not in printed(console)
        until(console, "gold")


def test_many_materials_take_few_lines():
    console = screen(terminal=False)
    with Display("nacre fit", console) as display:
        for index in range(50):
            display.add(f"m{index}")("training", 1, 9)
        text = until(console, "and 46 more\n")
    assert text.count("\n") == 5


@pytest.mark.parametrize(("terminal", "wait"), [(False, "EVERY"), (True, "DELAY")])
def test_what_is_over_soon_prints_nothing(monkeypatch, terminal, wait):
    monkeypatch.setattr(module, wait, 5.0)
    console = screen(terminal=terminal)
    with Display("nacre fit", console) as display:
        display.add("gold")("training", 1, 100)
    assert printed(console) == ""


def test_a_terminal_shows_what_is_in_work_and_is_left_clean():
    console = screen(terminal=True)
    now = begin()
    with Display("nacre fit", console) as display:
        now.display = display
        watcher = RunWatcher("library")
        watcher.begin(1000)
        reports = {name: watcher.start(name) for name in ("gold", "sub/[b]silver", "tin")}
        reports["gold"]("training", 3, 100, "held-out loss 0.1")
        watcher.end("sub/[b]silver", None)
        watcher.end("tin", "is empty")
        watcher.start("zinc")
        text = until(console, "zinc")
    assert "2 running, 1 failed" in text
    assert "2/1,000" in text
    assert re.search(r"gold +training .* 3/100", text)
    assert "held-out loss 0.1" in text
    last = text.rpartition("library")[2]
    assert "silver" not in last
    assert "tin" not in last.replace("starting", "")
    assert display._live is None


def test_a_piped_command_shows_progress_if_it_is_long_and_not_quiet(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    nacre.save(Glossy(0.2, 0.5, 0.3), "gold.binary")
    console = screen(terminal=False)
    monkeypatch.setattr(report, "status", console)
    options = ("fit", "gold.binary", "--epochs", 1, "--samples", 2000)
    monkeypatch.setattr(module, "EVERY", 60.0)
    assert run(*options, quiet=False) == 0
    assert printed(console) == ""
    monkeypatch.setattr(module, "EVERY", 0.0)
    assert run(*options) == 0
    assert printed(console) == ""
    assert run(*options, quiet=False) == 0
    assert printed(console).startswith(("nacre fit: starting\n", "fit: looking", "gold: "))


def test_verbose_tells_times_and_causes(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    nacre.save(Glossy(0.2, 0.5, 0.3), "gold.binary")
    console = screen(terminal=False)
    monkeypatch.setattr(report, "status", console)
    assert run("convert", "gold.binary", "-o", "gold.npz", "-v", quiet=False) == 0
    assert f"reads {tmp_path / 'gold.binary'}\n" in printed(console)
    assert f"writes {tmp_path / 'gold.npz'}\n" in printed(console)
    assert re.search(r"gold: writing: \d+\.\d\d s\n", printed(console))
    assert re.search(r"nacre convert: \d+\.\d\d s\n", printed(console))
    assert run("measure", "bsdf", "{", "-o", "x.binary", "-v", quiet=False) == 2
    assert "because of JSONDecodeError" in printed(console)
    assert "Traceback" not in printed(console) + capsys.readouterr().err
