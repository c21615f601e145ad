"""Commands and groups: shared options, lazy loading, help, suggestions."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

import click

import nacre
from nacre.cli.session import session
from nacre.errors import NacreError, did_you_mean
from nacre.io.outputs import overwrite, written_by
from nacre.registry import Registry


def _flag(name: str, *names: str, about: str) -> click.Option:
    def callback(_context: click.Context, _parameter: click.Parameter, value: bool) -> None:
        if value:
            setattr(session(), name, True)

    return click.Option(names, is_flag=True, expose_value=False, callback=callback, help=about)


def _print_version(context: click.Context, _parameter: click.Parameter, value: bool) -> None:
    if value and not context.resilient_parsing:
        click.echo(f"nacre, version {nacre.__version__}")
        context.exit()


def _shared() -> list[click.Parameter]:
    return [
        _flag("quiet", "-q", "--quiet", about="Print no progress and no notes."),
        _flag("verbose", "-v", "--verbose", about="Print timings, paths and the causes of errors."),
        click.Option(
            ("-V", "--version"),
            is_flag=True,
            expose_value=False,
            is_eager=True,
            callback=_print_version,
            help="Print the version and exit.",
        ),
    ]


def _help_alone() -> None:
    context = click.get_current_context()
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


class Command(click.Command):
    """A command with the shared options, --force if it writes, --json if it reports, and --dry-run
    if it can tell its plans.
    """

    def __init__(
        self, *, writes: bool = False, reports: bool = False, plans: bool = False, **settings: Any
    ) -> None:
        super().__init__(**settings)
        if plans:
            text = "Say what would be read and written, and how much work it is; write nothing."
            self.params.append(_flag("dry_run", "--dry-run", about=text))
        if reports:
            text = "Print the results as JSON, with units in the keys."
            self.params.append(_flag("as_json", "--json", about=text))
        if writes:
            text = "Replace files even if they are measured, read-only or not written by nacre."
            self.params.append(_flag("force", "--force", about=text))
        self.params.extend(_shared())

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """See click; what is wrong with the call is told with the line to type."""
        from nacre.cli.calls import check_inputs, explained

        call = list(args)
        with explained(self, ctx, call):
            rest = super().parse_args(ctx, args)
        if not ctx.resilient_parsing:
            check_inputs(self, ctx, call)
        return rest

    def invoke(self, ctx: click.Context) -> Any:
        """See click; shows progress while the command runs."""
        from nacre.cli.display import Display
        from nacre.cli.report import detail, status

        now, began = session(), time.monotonic()
        display = Display(ctx.command_path, status, quiet=now.quiet, verbose=now.verbose)
        with display, overwrite(now.force), written_by(ctx.command_path):
            now.display = display
            result = super().invoke(ctx)
        now.flush()
        detail(f"{ctx.command_path}: {time.monotonic() - began:.2f} s")
        return result


class Group(click.Group):
    """A group whose commands are imported only when they run, so that help appears at once.

    Parameters
    ----------
    package
        Has a module named after each built-in command, with the command as `command`.
    commands_help
        Built-in commands with their texts in the list.
    entry_points
        Group of entry points through which other packages add commands.
    elsewhere
        Commands of our other packages: the text in the list, and the package to install.
    """

    def __init__(
        self,
        name: str,
        *,
        package: str,
        commands_help: Mapping[str, str],
        entry_points: str | None = None,
        elsewhere: Mapping[str, tuple[str, str]] | None = None,
        **settings: Any,
    ) -> None:
        super().__init__(
            name,
            callback=_help_alone,
            invoke_without_command=True,
            subcommand_metavar="COMMAND [ARGS]...",
            **settings,
        )
        self._elsewhere = dict(elsewhere or {})
        self._help = dict(commands_help) | {n: about for n, (about, _) in self._elsewhere.items()}
        places = {name: f"{package}.{name}:command" for name in commands_help}
        self._commands: Registry[click.Command] = Registry(
            entry_points or package, "command", places, base=click.Command
        )
        self.params.extend(_shared())

    def list_commands(self, ctx: click.Context) -> list[str]:
        return sorted(self._commands)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        return self._commands.get(cmd_name)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """See click; for an unknown command, name the package to install or similar commands."""
        if args and not args[0].startswith("-") and args[0] not in self._commands:
            if args[0] in self._elsewhere:
                package = self._elsewhere[args[0]][1]
                raise NacreError(f"{args[0]!r} comes with {package}: pip install {package}")
            ctx.fail(f"No such command {args[0]!r}{did_you_mean(args[0], self._commands)}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, self._about(name)) for name in self.list_commands(ctx)])

    def _about(self, name: str) -> str:
        """Text in the list; a command from another package is loaded for it."""
        if name in self._help:
            return self._help[name]
        try:
            return self._commands[name].get_short_help_str(100)
        except NacreError as error:
            return f"({error})"


def command(
    name: str,
    *rows: click.Parameter | str,
    writes: bool = True,
    reports: bool = True,
    plans: bool = False,
) -> Callable[[Callable[..., Any]], Command]:
    """Make a function a :class:`Command`.

    `rows` are arguments and options in the order of the help; a text is the help of the option
    before it.
    """
    parameters: list[click.Parameter] = []
    for row in rows:
        if isinstance(row, click.Parameter):
            parameters.append(row)
        else:
            assert isinstance(parameters[-1], click.Option)
            parameters[-1].help = row
    kinds = {"writes": writes, "reports": reports, "plans": plans}
    return click.command(name, Command, params=parameters, **kinds)
