"""What holds for every command: options, help, how groups and unknown names are answered."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator

import click
import pytest

import nacre
from nacre.cli import root
from nacre.cli.layout import heading, is_shared
from nacre.cli.ranges import FiniteRange, IntRange, in_words, positive
from tests.cli.support import run

INSTRUMENTS = {f"measure {name}" for name in ("gloss", "haze", "sphere", "45-0")}
SILENT = {"cache", "completion", "help", "materials", *INSTRUMENTS}
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
    # A choice or a name; a file or a folder; a width, in nacre render maybe with a height.
    allowed = {"--model", "--output", "--basis", "--size"}
    assert set(mixed) <= allowed, mixed


def test_groups_alone_print_their_help(capsys):
    for group, titles in (
        ((), ("Look at materials", "Make materials", "More", "Shared options")),
        (("btf",), ("Encode textures", "Shared options")),
        (("latent",), ("Codes", "Bases", "Shared options")),
        (("measure",), ("Instruments", "Measurements", "Shared options")),
    ):
        assert run(*group, quiet=False) == 0
        alone = capsys.readouterr()
        assert alone.err == ""
        for title in titles:
            assert f"\n{title}:\n" in alone.out
        assert "\\n" not in alone.out
        for spelled in ((*group, "--help"), ("help", *group)):
            assert run(*spelled, quiet=False) == 0
            assert capsys.readouterr().out == alone.out


@pytest.mark.parametrize("name", LEAVES)
def test_many_options_stand_in_groups_of_at_most_ten(name):
    own = [o for o in options(LEAVES[name]) if not is_shared(o)]
    groups = Counter(map(heading, own))
    assert max(groups.values(), default=0) <= 10, groups
    assert len(own) <= 8 or len(groups) > 1, groups


@pytest.mark.parametrize("columns", [80, 120])
@pytest.mark.parametrize("name", ["", *ALL])
def test_help_fits_the_terminal(name, columns, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(columns))
    assert run(*name.split(), "--help") == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= columns
    assert len(lines) <= 100, "more than two screens"


def test_ranges_are_in_words():
    for name, command in LEAVES.items():
        for o in options(command):
            if isinstance(o.type, click.IntRange | click.FloatRange):
                assert isinstance(o.type, IntRange | FiniteRange), (name, o.opts)
                assert not re.search("[<>=]", in_words(o.type))


@pytest.mark.parametrize(
    ("kind", "given", "message"),
    [
        (IntRange(1), "0", "expected 1 or more, got 0"),
        (IntRange(1), "x", "expected a whole number (1 or more), got 'x'"),
        (IntRange(16, 1024), "2000", "expected 16 to 1,024, got 2,000"),
        (IntRange(None, 7), "8", "expected up to 7, got 8"),
        (FiniteRange(0.0, 89.0), "89.5", "expected 0 to 89, got 89.5"),
        (FiniteRange(0.0, 1.0, max_open=True), "1", "expected 0 or more, below 1, got 1"),
        (FiniteRange(0.0), "nan", "expected a number (0 or more), got 'nan'"),
        (FiniteRange(0.0), "inf", "expected a finite number, got inf"),
        (positive(1e6), "0", "expected above 0, up to 1,000,000, got 0"),
    ],
)
def test_values_out_of_range_are_refused_in_words(kind, given, message):
    with pytest.raises(click.BadParameter) as error:
        kind.convert(given, None, None)
    assert error.value.message == message


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
