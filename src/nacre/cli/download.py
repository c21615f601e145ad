from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from nacre.cli import options, plans
from nacre.cli.command import command as make
from nacre.cli.display import Line
from nacre.cli.options import option
from nacre.cli.report import (
    aside,
    hidden_progress,
    print_facts,
    print_json,
    progress,
    report_parts,
    say,
)
from nacre.errors import NacreError
from nacre.io.source import TERMS


@make(
    "download",
    options.argument("database", None, required=False),
    options.argument("materials", None, nargs=-1),
    options.output_option("Folder to write to.", required=False, shown="the cache"),
    option("--all everything", is_flag=True, help="Download all materials."),
    option("--mirror", metavar="URL", shown="NACRE_MIRROR"),
    "Server that offers DATABASE/FILE.",
    option("--accept-terms", is_flag=True, help="Accept the terms of use without being asked."),
    plans=True,
)
def command(
    database: str | None,
    materials: tuple[str, ...],
    everything: bool,
    output: Path | None,
    mirror: str | None,
    accept_terms: bool,
) -> None:
    """Download measured materials from a public database, and print where they are.

    Without MATERIALS, list them; without DATABASE, list the databases. MATERIALS may be patterns
    in quotes, such as 'gold-*'. Interrupted downloads resume. Files are kept in the platform's
    cache folder or in NACRE_CACHE.
    """
    from nacre.download import UnreachableError, databases, fetch, find

    if database is None:
        if output or mirror or accept_terms or everything:
            raise click.UsageError("expected the name of a database")
        known = [(each.name, each.title) for each in databases().values()]
        print_json([{"database": name, "title": title} for name, title in known])
        print_facts("databases", known)
        return
    source = find(database)
    if everything:
        if materials:
            raise click.UsageError("expected either names or --all")
        materials = ("*",)
    if not materials:
        names = list(source.materials)
        print_json({"database": source.name, "page": source.page, "materials": names})
        say("\n".join(names) or f"{source.name}: names are at {source.page}")
        return

    if plans.is_wanted():
        plans.tell_download(source, source.select(materials), output)
        return

    def agree(terms: str) -> bool:
        if not accept_terms and not sys.stdin.isatty():
            raise click.ClickException(
                f"{source.name}: has terms of use: read them at {source.page} and, if you accept "
                "them, add --accept-terms"
            )
        with hidden_progress():
            click.echo(terms, err=True)
            if accept_terms or click.confirm("Do you accept these terms?", err=True):
                return True
        raise click.ClickException(f"{source.name}: the terms are not accepted; nothing downloaded")

    results: list[dict[str, Any]] = []
    chosen = source.select(materials)
    for number, material in enumerate(chosen, 1):
        line = progress(material)
        try:
            found = fetch(source, material, output, mirror, agree, _reported(line))
        except UnreachableError as error:
            rest = len(chosen) - number
            untried = f"; {rest} more not tried" if rest else ""
            results.append({"material": material, "error": f"{error}{untried}"})
            break
        except NacreError as error:
            results.append({"material": material, "error": str(error)})
            continue
        finally:
            line.end()
        if source.free and found.fresh and not any(one.get("downloaded") for one in results):
            terms_file = found.path.with_name(f"{source.name}{TERMS}")
            aside(f"{source.name}: {source.free}; {terms_file} says what to cite")
        checked = "SHA-256 verified" if found.verified else "not verified: no known checksum"
        aside(f"{material}: {'downloaded' if found.fresh else 'already there'}, {checked}")
        say(str(found.path))
        results.append(
            {
                "material": material,
                "output": str(found.path),
                "size_bytes": found.path.stat().st_size,
                "downloaded": found.fresh,
                "verified": found.verified,
            }
        )
    report_parts(results)


def _reported(line: Line) -> Callable[[int, int | None], None]:
    return lambda done, total: line("downloading", done // 1000, (total or done) // 1000, "kB")
