"""What tests of several commands share."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from nacre.cli import main


def run(*arguments: object, quiet: bool = True) -> int:
    """Exit code of a command in this process, by default without progress and notes."""
    try:
        main([*(["-q"] if quiet else []), *map(str, arguments)])
    except SystemExit as stop:
        return int(stop.code or 0)
    return 0


def run_json(capsys: Any, *arguments: object) -> Any:
    """What a command reports with --json."""
    capsys.readouterr()
    assert run(*arguments, "--json") == 0
    return json.loads(capsys.readouterr().out)


def assert_refused(capsys: Any, words: str, *arguments: object) -> None:
    """A command says in one line what it cannot do, and leaves the working folder as it was."""
    before = sorted(Path().iterdir())
    assert run(*arguments) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.startswith("nacre: ")
    assert error.count("\n") == 1
    assert sorted(Path().iterdir()) == before
