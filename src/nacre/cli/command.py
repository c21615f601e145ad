"""Commands and groups: shared options, lazy loading, help, suggestions."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import nullcontext
from importlib.util import find_spec
from typing import Any

import click

import nacre
from nacre.cli.layout import options_of, write
from nacre.cli.session import session
from nacre.errors import NacreError
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
    """A command with the shared options, --force if it writes, --json if it reports, --dry-run if
    it can tell its plans, and those of :mod:`nacre.cli.reading` if it reads materials.
    """

    def __init__(
        self,
        *,
        writes: bool = False,
        reports: bool = False,
        plans: bool = False,
        reads: bool = False,
        **settings: Any,
    ) -> None:
        super().__init__(**settings)
        self._works = writes or reports
        if reads:
            from nacre.cli.reading import options

            self.params.extend(options())
        if plans:
            text = "Say what would be read and written, and how much work it is; write nothing."
            self.params.append(_flag("dry_run", "--dry-run", about=text))
        if reports:
            text = "Print the results as JSON, with units in the keys."
            self.params.append(_flag("as_json", "--json", about=text))
        if writes:
            text = "Replace files even if measured, read-only or not nacre's own."
            self.params.append(_flag("force", "--force", about=text))
        self.params.extend(_shared())

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        write(formatter, options_of(self, ctx))

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
        from nacre.cli.reading import applied
        from nacre.cli.report import detail, status
        from nacre.io.outputs import overwrite, written_by

        now, began = session(), time.monotonic()
        display = Display(
            ctx.command_path, status, quiet=now.quiet or not self._works, verbose=now.verbose
        )
        with display, overwrite(now.force), written_by(ctx.command_path):
            now.display = display
            with applied(ctx) if now.reading else nullcontext():
                result = super().invoke(ctx)
        now.flush()
        detail(f"{ctx.command_path}: {time.monotonic() - began:.2f} s")
        return result


class Group(click.Group):
    """A group whose commands are imported only when they run, so that help appears at once.

    Parameters
    ----------
    package
        Has a module named after each built-in command, with the command as `command`; that of a
        group is a package.
    commands_help
        Built-in commands with their texts in the list, under headings.
    modules
        Modules of built-in commands whose names Python cannot take.
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
        commands_help: Mapping[str, Mapping[str, str]],
        modules: Mapping[str, str] | None = None,
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
        self._package, self._elsewhere = package, dict(elsewhere or {})
        self._sections = {title: dict(rows) for title, rows in commands_help.items()}
        self.built_in = [name for rows in self._sections.values() for name in rows]
        self._modules = {name: (modules or {}).get(name, name) for name in self.built_in}
        places = {name: f"{package}.{self._modules[name]}:command" for name in self.built_in}
        self._commands: Registry[click.Command] = Registry(
            entry_points or package, "command", places, base=click.Command
        )
        self.params.extend(_shared())

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(self._commands)

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
            if ctx.parent is None:
                from nacre.cli.unnamed import answer_file

                answer_file(args, self._commands)
            similar = self._similar(ctx, args[0])
            hint = f"; did you mean {' or '.join(similar)}?" if similar else ""
            ctx.fail(f"no command {args[0]!r}{hint}")
        return super().resolve_command(ctx, args)

    def _similar(self, ctx: click.Context, name: str) -> list[str]:
        """Commands, as typed, that an unknown one may mean: of its name elsewhere, or alike."""
        import difflib

        root = ctx.find_root()
        assert isinstance(root.command, Group)
        same = [
            " ".join((root.command_path, *path))
            for path in root.command._paths()
            if path[-1] == name
        ]
        near = difflib.get_close_matches(name, self._commands, 3)
        return same or [f"{ctx.command_path} {each}" for each in near]

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        write(formatter, self.commands_by_heading())
        write(formatter, options_of(self, ctx))

    def _paths(self) -> Iterator[tuple[str, ...]]:
        """The built-in commands of this group and of the groups in it, as typed after it."""
        for name in self.built_in:
            yield (name,)
            spec = find_spec(f"{self._package}.{self._modules[name]}")
            if spec is not None and spec.submodule_search_locations:  # others need not be imported
                child = self._commands[name]
                assert isinstance(child, Group)
                yield from ((name, *path) for path in child._paths())

    def commands_by_heading(self) -> dict[str, list[tuple[str, str]]]:
        """Names and texts of all commands under headings; those from other packages come last."""
        sections = {title: list(rows.items()) for title, rows in self._sections.items()}
        for name in self._commands:
            if name not in self.built_in:
                package = self._commands.package(name) or "other packages"
                sections.setdefault(f"From {package}", []).append((name, self._about(name)))
        return sections

    def _about(self, name: str) -> str:
        """Text in the list for a command from another package, loaded unless it is ours."""
        if name in self._elsewhere:
            return self._elsewhere[name][0]
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
    reads: bool = False,
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
    kinds = {"writes": writes, "reports": reports, "plans": plans, "reads": reads}
    return click.command(name, Command, params=parameters, **kinds)
