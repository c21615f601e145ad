"""`nacre info`."""

from __future__ import annotations

from pathlib import Path

import click

from nacre.cli.console import existing_file, print_facts


@click.command("info")
@click.argument("files", nargs=-1, required=True, type=existing_file())
def command(files: tuple[Path, ...]) -> None:
    """Show what is in a measured table or a neural material."""
    from nacre.formats import load

    for path in files:
        brdf = load(path)
        facts = dict(brdf.describe())
        facts["file"] = f"{path} ({path.stat().st_size:,} bytes)"
        facts["sha256"] = (brdf.source or {}).get("sha256", "")
        print_facts(path.name, facts.items())
