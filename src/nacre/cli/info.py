"""`nacre info`."""

from __future__ import annotations

from pathlib import Path

import click

from nacre.cli.console import file_path, print_facts, printable
from nacre.files import NacreError


@click.command("info")
@click.argument("files", nargs=-1, required=True, type=file_path())
def command(files: tuple[Path, ...]) -> None:
    """Show what is in a measured table or a neural material."""
    from nacre.formats import load

    failures = []
    for path in files:
        try:
            brdf = load(path)
        except NacreError as error:
            failures.append(error)
            continue
        facts = dict(brdf.describe())
        facts["file"] = f"{path} ({path.stat().st_size:,} bytes)"
        facts["sha256"] = (brdf.source or {}).get("sha256", "")
        print_facts(path.name, facts.items())
    for failure in failures[:-1]:
        click.echo(f"nacre: {printable(str(failure))}", err=True)
    if failures:
        raise failures[-1]
