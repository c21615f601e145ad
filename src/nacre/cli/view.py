"""`nacre view`."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.options import option
from nacre.cli.progress import progress
from nacre.cli.report import counted, fail, note, report
from nacre.errors import NacreError

if TYPE_CHECKING:
    from nacre.render.environment import Environment

_PAGE = ".html"


@make(
    "view",
    options.inputs_argument(),
    options.output_option("Page to write (.html).", required=False, shown="none: it is served"),
    option("--title", metavar="TEXT", shown="the name of INPUT"),
    "Heading of the page.",
    option("--environment", options.INPUT, multiple=True, shown="the built-in ones"),
    "Light from a latitude-longitude map (.exr, .hdr, .png); several for a choice of them.",
    option("--port", click.IntRange(0, 65535), default=0, shown="any that is free"),
    "Port of this machine to serve the page on.",
    option("--open/--no-open opened", default=True),
    "Open the page that is served in a browser.",
)
def command(
    paths: tuple[Path, ...],
    output: Path | None,
    title: str | None,
    environment: tuple[Path, ...],
    port: int,
    opened: bool,
) -> None:
    """Show materials on a page in a browser: turned in the light, and side by side.

    The page is one file that needs nothing else, for screens and for sending; without --output it
    is served on this machine until Ctrl-C. Of a folder, all materials in it and below are shown.
    Files of one name in one folder are one material: measured, as a network, in standard form. An
    encoded texture has the height field (.exr) of its name, if there is one beside it.
    """
    from nacre.formats import is_btf
    from nacre.viewer.content import Content
    from nacre.workflows.viewing import find_materials, read_entries, read_texture

    if output is not None and output.suffix.lower() != _PAGE:
        raise NacreError(f"{output}: expected a name that ends in {_PAGE}")
    if output is not None and (options.is_given("port") or options.is_given("opened")):
        raise click.UsageError("--port and --open are for a page that is served, without --output")
    found = find_materials(paths)
    options.check_outputs([output], [shown.path for shown in found])
    title = title or (paths[0].stem if len(paths) == 1 else "Materials")
    content = Content(_environments(environment))
    line = progress(title, "reading")
    textures = [shown for shown in found if is_btf(shown.path)]
    others = [shown for shown in found if shown not in textures]
    count = 0
    for entry in read_entries(others, partial(_left_out, paths)):
        count += 1
        line("reading", count, len(found), entry.name)
        content.add(entry)
    for shown in textures:
        line("reading", count, len(found), shown.path.stem)
        try:
            content.add_texture(*read_texture(shown.path), {"File": shown.path.stem})
            count += 1
        except NacreError as error:
            _left_out(paths, shown.path, error)
    if not count:
        raise NacreError("no material could be read")
    line("writing", 0, 1)
    page = content.page(title)
    line.end()
    if output is not None:
        _write(page, output, count)
    else:
        _serve(page, port, opened, count)


def _left_out(given: tuple[Path, ...], path: Path, error: NacreError) -> None:
    """What cannot be read is said and passed over where it was met in a folder."""
    if path in given:
        raise error
    fail(str(error))


def _environments(paths: tuple[Path, ...]) -> list[Environment]:
    from nacre.render.environment import load_environment
    from nacre.render.studio import studio
    from nacre.render.surroundings import late_sun, overcast, room

    return [load_environment(path) for path in paths] or [studio(), overcast(), late_sun(), room()]


def _write(content: bytes, output: Path, count: int) -> None:
    from nacre.io.files import atomic_path

    with atomic_path(output) as path:
        path.write_bytes(content)
    shown = counted(count, "material", "materials")
    data = {"output": str(output), "materials": count, "size_bytes": len(content)}
    report(f"{output}: {shown}, {len(content):,} bytes", data)


def _serve(content: bytes, port: int, opened: bool, count: int) -> None:
    import webbrowser

    from nacre.runtime.interrupts import Terminated
    from nacre.viewer.server import PageServer

    try:
        server = PageServer(content, port)
    except OSError as error:
        raise NacreError(f"--port {port}: cannot be used: {error.strerror}") from error
    with server:
        report(f"{server.url} (Ctrl-C ends)", {"url": server.url, "materials": count})
        if opened and not webbrowser.open(server.url):
            note("no browser could be opened; open the address above")
        try:
            server.serve_forever()
        except Terminated:
            raise
        except KeyboardInterrupt:
            pass
