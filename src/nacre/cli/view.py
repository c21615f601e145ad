from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nacre.cli import options, plans
from nacre.cli.command import command as make
from nacre.cli.display import Line
from nacre.cli.options import option
from nacre.cli.ranges import IntRange
from nacre.cli.report import counted, fail, note, progress, report, report_file
from nacre.errors import FormatError, NacreError

if TYPE_CHECKING:
    from nacre.mitsuba.environment import Environment
    from nacre.workflows.sources import Source

_PAGE, _SCRIPT = ".html", ".js"
_NOTICE = 1 << 20  # bytes


@make(
    "view",
    options.argument("paths", nargs=-1, metavar="INPUT..."),
    options.output_option("Page to write (.html).", required=False, shown="served instead"),
    option("--title", metavar="TEXT", shown="INPUT's name"),
    "Heading of the page.",
    option("--environment", options.INPUT, multiple=True, shown="the built-in ones"),
    "Latitude-longitude map to offer as light (.exr, .hdr, .png). May be repeated.",
    option("--map mapped", is_flag=True),
    "Add a map for exploring what lies between the materials; 0.6 MB.",
    option("--notice", options.INPUT, metavar="FILE"),
    "Text for the foot of the page, such as a license.",
    option("--component", is_flag=True),
    "Write only the script (.js) that defines the element <nacre-view> for other pages.",
    options.height_field_option(shown="NAME.exr beside it, if any"),
    "Gray image for parallax of a single texture.",
    options.depth_option(),
    option("--port", IntRange(0, 65535), group="a served page", default=0, shown="any free one"),
    "Port to serve the page on.",
    option("--open/--no-open opened", group="a served page", default=True),
    "Open the served page in a browser.",
    plans=True,
    reads=True,
)
def command(paths: tuple[Path, ...], output: Path | None, **chosen: Any) -> None:
    """Show materials on a web page, where you can turn them in the light and compare them.

    The page is one self-contained file; without --output it is served on this machine until Ctrl-C.
    For a folder, all materials in it and below are shown. Files with the same name in one folder
    are forms of one material: measured, network, standard. Textures must be encoded by nacre fit.
    """
    _check(paths, output, chosen)
    if chosen["component"] and output is not None:
        from nacre.viewer.component import component

        options.check_outputs([output], [])
        _write(component(), output)
        return
    from nacre.workflows.viewing import find_materials

    found = find_materials(paths)
    if plans.is_wanted():
        work = f"show {counted(len(found), 'material', 'materials')} on a page"
        work += "" if output else ", served on this machine until Ctrl-C"
        plans.tell([each.path for each in found], [(output, "")] if output else [], work)
        return
    options.check_outputs([output], [source.path for source in found])
    stems = {path.stem for path in paths}
    title = chosen["title"] or (paths[0].stem if len(stems) == 1 else "Materials")
    line = progress(title, "reading")
    failed: list[Path] = []
    page, count = _page(title, found, chosen, line, partial(_left_out, paths, failed))
    line.end()
    if output is not None:
        _write(page, output, counted(count, "material", "materials"), materials=count)
    else:
        _serve(page, chosen["port"], chosen["opened"], count)
    if failed:
        raise SystemExit(1)


def _check(paths: tuple[Path, ...], output: Path | None, chosen: Mapping[str, Any]) -> None:
    """Raise a UsageError for options that do not go together."""
    component = chosen["component"]
    if bool(paths) == component:
        raise click.UsageError("expected INPUT..., or --component alone")
    if component and output is None:
        raise click.UsageError("--component: expected --output, such as nacre-view.js")
    ending = _SCRIPT if component else _PAGE
    if output is not None and output.suffix.lower() != ending:
        raise NacreError(f"{output}: expected a name that ends in {ending}")
    if output is not None and (options.is_given("port") or options.is_given("opened")):
        raise click.UsageError("--port and --open are for a served page; leave out --output")
    if chosen["depth"] is not None and chosen["height_field"] is None:
        raise click.UsageError("--depth needs a --height-field")


def _page(
    title: str,
    found: Sequence[Source],
    chosen: Mapping[str, Any],
    line: Line,
    left_out: Callable[[Path, NacreError], None],
) -> tuple[bytes, int]:
    """The page, and the number of materials and textures on it."""
    from nacre.targets.textures import HeightField
    from nacre.workflows.viewing import page_content, read_materials

    image, notice = chosen["height_field"], chosen["notice"]
    content, count = page_content(
        read_materials(found, left_out),
        environments=_environments(chosen["environment"]),
        mapped=chosen["mapped"],
        heights=None if image is None else HeightField.read(image, chosen["depth"]),
        notice=None if notice is None else _notice(notice),
        total=len(found),
        progress=line,
    )
    line("writing", 0, 1)
    return content.page(title), count


def _left_out(given: tuple[Path, ...], failed: list[Path], path: Path, error: NacreError) -> None:
    """Report a file that cannot be read; raise if it was named itself, not found in a folder."""
    if path in given:
        raise error
    fail(str(error))
    failed.append(path)


def _environments(paths: tuple[Path, ...]) -> list[Environment]:
    from nacre.mitsuba.environment import load_environment

    return [load_environment(path) for path in paths]


def _notice(path: Path) -> str:
    from nacre.io.files import read_bytes

    try:
        return read_bytes(path, _NOTICE).decode()
    except UnicodeDecodeError as error:
        raise FormatError(f"{path}: is not text in UTF-8") from error


def _write(content: bytes, output: Path, text: str = "", **data: Any) -> None:
    from nacre.io.files import atomic_path

    with atomic_path(output) as path:
        path.write_bytes(content)
    report_file(output, text, **data)


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
