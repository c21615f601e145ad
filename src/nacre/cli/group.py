"""A group of commands that are imported when they run."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any

import click

from nacre.io.outputs import written_by


class LazyGroup(click.Group):
    """Lists commands without importing them: help must come at once.

    Parameters
    ----------
    package
        Package that has a module for each command, named like it, with the command as `command`.
    commands_help
        The commands, each with what the list says of it.
    """

    def __init__(self, *, package: str, commands_help: Mapping[str, str], **settings: Any) -> None:
        super().__init__(**settings)
        self._package, self._help = package, dict(commands_help)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """See click; what the command writes is known as its own from here on."""
        name, command, rest = super().resolve_command(ctx, args)
        ctx.with_resource(written_by(f"{ctx.command_path} {name}"))
        return name, command, rest

    def list_commands(self, ctx: click.Context) -> list[str]:
        """See click."""
        return sorted(self._help)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """See click."""
        if cmd_name not in self._help:
            return None
        module = importlib.import_module(f"{self._package}.{cmd_name}")
        command: click.Command = module.command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """See click."""
        with formatter.section("Commands"):
            formatter.write_dl(sorted(self._help.items()))
