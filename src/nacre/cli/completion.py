from __future__ import annotations

import click
from click.shell_completion import get_completion_class

from nacre.cli.command import command as make
from nacre.errors import NacreError


@make(
    "completion",
    click.Argument(["shell"], type=click.Choice(["bash", "zsh", "fish"])),
    writes=False,
    reports=False,
)
@click.pass_context
def command(context: click.Context, shell: str) -> None:
    """Print a script that completes commands, options, files and materials in a shell.

    \b
    bash, in ~/.bashrc:  eval "$(nacre completion bash)"
    zsh, in ~/.zshrc:    eval "$(nacre completion zsh)"
    fish:  nacre completion fish > ~/.config/fish/completions/nacre.fish

    Names of materials such as rgl:paper_white are completed after their colon; in bash only if
    the colon does not break words: COMP_WORDBREAKS=${COMP_WORDBREAKS//:}.
    """  # noqa: D301, click marks a paragraph to keep as it is with a control character
    kind = get_completion_class(shell)
    assert kind is not None  # click knows all three
    try:
        script = kind(context.find_root().command, {}, "nacre", "_NACRE_COMPLETE").source()
    except (OSError, RuntimeError) as error:
        raise NacreError(f"{shell}: {error}") from error
    click.echo(script)
