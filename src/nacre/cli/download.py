"""`nacre download`."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import click

from nacre.cli.console import StageCallback, Stages, console, file_path, print_facts, status
from nacre.errors import NacreError


@click.command("download")
@click.argument("database", required=False)
@click.argument("materials", nargs=-1)
@click.option("--all", "everything", is_flag=True, help="All materials of the database.")
@click.option("-o", "--output", type=file_path(), help="Folder. Default: the cache.")
@click.option("--mirror", metavar="URL", help="Where DATABASE/FILE lies. Default: NACRE_MIRROR.")
@click.option("--accept-terms", is_flag=True, help="Accept the terms of use without being asked.")
def command(
    database: str | None,
    materials: tuple[str, ...],
    everything: bool,
    output: Path | None,
    mirror: str | None,
    accept_terms: bool,
) -> None:
    """Download measured materials from a public database, and print where they are.

    Without MATERIALS, list them; without DATABASE, list the databases. MATERIALS may have wildcards
    in quotes: 'gold-*'. A download that broke off goes on where it was. Files are kept in the
    platform's cache folder, or in NACRE_CACHE.
    """
    from nacre.download import databases, fetch, find

    if database is None:
        if output or mirror or accept_terms or everything:
            raise click.UsageError("expected the name of a database")
        print_facts("databases", ((each.name, each.title) for each in databases().values()))
        return
    source = find(database)
    if everything:
        if materials:
            raise click.UsageError("expected either names or --all")
        materials = ("*",)
    if not materials:
        names = "\n".join(source.materials) or f"{source.name}: names are at {source.page}"
        console.print(names, markup=False)
        return

    def agree(terms: str) -> bool:
        click.echo(terms, err=True)
        if accept_terms:
            return True
        if not sys.stdin.isatty():
            raise NacreError(
                f"{source.name}: read the terms of use above; --accept-terms accepts them"
            )
        return click.confirm("Do you accept these terms?", err=True)

    for material in source.select(materials):
        with ExitStack() as display:
            found = fetch(source, material, output, mirror, agree, _progress(display, material))
        done = "downloaded" if found.fresh else "already there"
        checked = "SHA-256 is as expected" if found.verified else "not verified: no known checksum"
        status.print(f"{material}: {done}, {checked}", markup=False)
        console.print(str(found.path), markup=False)


def _progress(display: ExitStack, material: str) -> Callable[[int, int | None], None]:
    """A display that appears with the first bytes: what is there already needs none."""
    reports: list[StageCallback] = []

    def progress(done: int, total: int | None) -> None:
        if not reports:
            reports.append(display.enter_context(Stages()).add(material))
        reports[0]("downloading", done // 1000, (total or done) // 1000, "kB")

    return progress
