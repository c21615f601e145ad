"""What tests of several commands share."""

from __future__ import annotations

from nacre.cli import main


def run(*arguments: object) -> int:
    """Exit code of a command in this process."""
    try:
        main([str(argument) for argument in arguments])
    except SystemExit as stop:
        return int(stop.code or 0)
    return 0
