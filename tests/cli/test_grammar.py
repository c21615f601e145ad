"""What holds for every command: options, help, how groups and unknown names are answered."""

from __future__ import annotations

import re
from collections.abc import Iterator

import click
import pytest

import nacre
from nacre.cli import root
from tests.cli.support import run

SILENT = {"cache", "completion", "help", "materials"}
"""Commands that write nothing."""
UNREPORTED = {"completion", "help", "demo"}


def commands(group: click.Group, parent: click.Context) -> Iterator[tuple[str, click.Command]]:
    """Every command below a group, by its full name."""
    for name in group.list_commands(parent):
        command = group.get_command(parent, name)
        assert command is not None
        if isinstance(command, click.Group):
            context = click.Context(command, parent=parent, info_name=name)
            yield from ((f"{name} {rest}", c) for rest, c in commands(command, context))
        yield name, command


CONTEXT = click.Context(root, info_name="nacre", **root.context_settings)
ALL = dict(commands(root, CONTEXT))
LEAVES = {name: c for name, c in ALL.items() if not isinstance(c, click.Group)}


def options(command: click.Command) -> list[click.Option]:
    return [p for p in command.params if isinstance(p, click.Option)]


@pytest.mark.parametrize("name", ALL)
def test_every_option_and_command_says_what_it_does(name):
    command = ALL[name]
    texts = {"": command.help or ""} | {o.opts[0]: o.help or "" for o in options(command)}
    for where, text in texts.items():
        assert re.match(r"[A-Z][a-zA-Z]+", text), (where, text)
        assert not re.match(r"(Of|What|Whether|How|That|Its|From|Between|Among)\b", text), where
        assert re.search(r"[.):]$", text.partition("\n\n")[0].strip()), (where, text)
        assert "[default" not in text, where
        assert "Default:" not in text, where


@pytest.mark.parametrize("name", ALL)
def test_every_command_takes_the_shared_options(name):
    known = {opt for o in options(ALL[name]) for opt in o.opts}
    assert {"-q", "--quiet", "-v", "--verbose", "-V", "--version"} <= known
    if name in LEAVES:
        assert ("--force" in known) == (name not in SILENT)
        assert ("--json" in known) == (name not in UNREPORTED)
        assert ("-o" in known) == (name not in {*SILENT, "info"})


def test_an_option_means_the_same_everywhere():
    types: dict[str, set[str]] = {}
    for command in LEAVES.values():
        for o in options(command):
            flag = max(o.opts, key=len)
            types.setdefault(flag, set()).add(f"{type(o.type).__name__} {o.type.name} {o.nargs}")
    mixed = {flag: kinds for flag, kinds in types.items() if len(kinds) > 1}
    allowed = {"--model", "--output", "--basis"}  # a choice or a name; a file or a folder
    assert set(mixed) <= allowed, mixed


def test_groups_alone_print_their_help(capsys):
    for group in ((), ("btf",), ("latent",)):
        assert run(*group, quiet=False) == 0
        alone = capsys.readouterr()
        assert alone.err == ""
        assert "Commands:\n" in alone.out
        assert "\\n" not in alone.out
        for spelled in ((*group, "--help"), ("help", *group)):
            assert run(*spelled, quiet=False) == 0
            assert capsys.readouterr().out == alone.out


def test_help_of_a_command_is_what_its_option_prints(capsys):
    assert run("help", "btf", "capture", quiet=False) == 0
    text = capsys.readouterr().out
    assert text.startswith("Usage: nacre btf capture [OPTIONS] [RECIPE]")
    assert run("btf", "capture", "-h", quiet=False) == 0
    assert capsys.readouterr().out == text


@pytest.mark.parametrize("name", LEAVES)
def test_help_prints_defaults_once(name, capsys):
    assert run(*name.split(), "--help") == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "[default: (" not in text
    assert not re.search(r"\] ?\[default", text)


@pytest.mark.parametrize("arguments", [("-V",), ("fit", "-V"), ("btf", "plan", "--version")])
def test_the_version_is_known_everywhere(capsys, arguments):
    assert run(*arguments) == 0
    assert capsys.readouterr().out == f"nacre, version {nacre.__version__}\n"


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_prints_a_script(capsys, shell):
    if shell == "bash":
        pytest.importorskip("subprocess").run(
            ["bash", "--version"], check=True, capture_output=True
        )
    assert run("completion", shell) == 0
    assert "_NACRE_COMPLETE" in capsys.readouterr().out


def test_options_are_completed():
    from click.shell_completion import ShellComplete

    complete = ShellComplete(root, {}, "nacre", "_NACRE_COMPLETE")
    assert "render" in {item.value for item in complete.get_completions([], "re")}
    found = {item.value for item in complete.get_completions(["fit"], "--pre")}
    assert found == {"--preset", "--precision"}
    assert [item.type for item in complete.get_completions(["fit"], "go")] == ["file"]
