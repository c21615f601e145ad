"""The reference of the command line is made from its help texts; examples in the docs are right."""

from __future__ import annotations

import re
import runpy
import shlex
import tomllib
from pathlib import Path

import click
import pytest

from nacre.cli import LAB, root

ROOT = Path(__file__).parents[2]
EXAMPLE = tomllib.loads((ROOT / "docs/examples/pyproject.toml").read_text("utf-8"))["project"]
ELSEWHERE = {*LAB, *EXAMPLE["entry-points"]["nacre.commands"]}
"""Commands that other packages bring; checked where these are installed."""
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])
NAMES = [str(page.relative_to(ROOT)) for page in PAGES]


@pytest.mark.parametrize("lab", [False, True])
def test_page_is_what_the_generator_prints(lab: bool) -> None:
    page = runpy.run_path(str(ROOT / "scripts" / "command_line.py"))["page"]
    path = "lab/docs/command-line.md" if lab else "docs/reference/command-line.md"
    if lab:
        pytest.importorskip("nacre_lab")
    again = f"python scripts/command_line.py{' lab' if lab else ''} > {path}"
    assert (ROOT / path).read_text("utf-8") == page(lab=lab), f"out of date: {again}"


def examples(page: Path) -> list[list[str]]:
    """Arguments of every nacre command in code blocks that are neither Python nor usages."""
    found = []
    blocks = re.findall(r"^```(\w*)\n(.*?)^```", page.read_text("utf-8"), re.S | re.M)
    code = "".join(text for kind, text in blocks if kind in ("", "bash", "sh"))
    for line in code.replace("\\\n", " ").splitlines():
        if not re.match(r"(nacre|torchrun) ", line) or "OPTIONS" in line:
            continue
        words = shlex.split(line, comments=True)
        for end in (">", "|"):
            if end in words:
                words = words[: words.index(end)]
        found.append(words[words.index("nacre") + 1 :])
    return found


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_examples_name_commands_and_options_that_exist(page: Path) -> None:
    for words in examples(page):
        command: click.Command = root
        context = click.Context(root, info_name="nacre", **root.context_settings)
        rest = words
        if words[0] in ELSEWHERE and command.get_command(context, words[0]) is None:
            continue
        while isinstance(command, click.Group) and rest:
            name, *rest = rest
            found = command.get_command(context, name)
            assert found is not None, f"nacre {shlex.join(words)}: no command {name}"
            command = found
        try:
            given, _, _ = command.make_parser(
                click.Context(command, **root.context_settings)
            ).parse_args(list(rest))
        except click.UsageError as error:
            pytest.fail(f"nacre {shlex.join(words)}: {error.format_message()}")
        required = {p.name for p in command.params if p.required and "--help" not in rest}
        missing = [name for name in required if not given.get(name)]
        assert not missing, f"nacre {shlex.join(words)}: lacks {', '.join(missing)}"
