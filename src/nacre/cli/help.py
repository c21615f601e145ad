from __future__ import annotations

import click

from nacre.cli.command import command as make


@make(
    "help", click.Argument(["names"], nargs=-1, metavar="[COMMAND]..."), writes=False, reports=False
)
@click.pass_context
def command(context: click.Context, names: tuple[str, ...]) -> None:
    """Show the help of a command, for example nacre help btf capture."""
    at = context.find_root()
    found: click.Command = at.command
    for name in names:
        if not isinstance(found, click.Group):
            raise click.UsageError(f"{at.command_path} has no commands of its own", at)
        _, child, _ = found.resolve_command(at, [name])
        assert child is not None  # an unknown name has raised
        found, at = child, click.Context(child, parent=at, info_name=name)
    click.echo(found.get_help(at))
