from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.kinds import kind_of
from nacre.cli.options import option
from nacre.cli.plot import name_apart
from nacre.cli.reading import chosen_material
from nacre.cli.report import keyed, note, print_facts, progress, report_parts, say, tell
from nacre.cli.session import session
from nacre.errors import FormatError, NacreError, printable

if TYPE_CHECKING:
    from nacre.brdf import Brdf
    from nacre.measured.textures.image_folder import Quantity


def several(path: Path) -> tuple[str, ...]:
    """Names of the materials of a file that holds several of which none was chosen."""
    from nacre.formats import materials_in

    if chosen_material(path):
        return ()
    with suppress(FormatError):
        names = materials_in(path)
        return names if len(names) > 1 else ()
    return ()


@make(
    "info",
    options.inputs_argument(),
    option("--physics/--no-physics", applies="brdf", default=True),
    "Compute energy, reciprocity and anisotropy.",
    option("--plot", options.OUTPUT),
    "Also plot the lobes of all reflectances (.png, .svg, .pdf).",
    options.pixels_option(applies="btf"),
    reads=True,
)
def command(
    paths: tuple[Path, ...], physics: bool, plot: Path | None, pixels: Quantity | None
) -> None:
    """Say what each INPUT holds, how large it is, and whether anything is wrong with it.

    A sentence each; -v adds all figures, and --json gives them to scripts.

    INPUT is a reflectance, a texture (a file, a folder of images or a list of photographs), or
    another file that nacre writes: a code, a latent basis, a texture codec or a map of texels.
    """
    from nacre.workflows import inspect

    if plot is not None:
        from nacre.figures.plot import check_count, check_plot_path

        check_plot_path(plot)
        options.check_outputs([plot], paths)
        check_count(len(paths))
    results: list[dict[str, Any]] = []
    plotted: list[tuple[Path, Brdf]] = []
    line = progress("info")
    for index, path in enumerate(paths):
        line("reading", index, len(paths), path.name)
        if len(paths) == 1:  # with several, an option concerns only those of its kind
            with suppress(FormatError):  # not a material
                kind_of(path)
        if names := several(path):
            line.end()
            say(printable(path.resolve().name), style="bold")
            rows = [(str(k), printable(name) or "(no name)") for k, name in enumerate(names, 1)]
            tell(
                [f"A file of {len(names)} materials; --material takes a name or a number."],
                indent=2,
            )
            print_facts("  materials", rows, {})
            results.append({"file": str(path), "kind": "several", "materials": list(names)})
            continue
        try:
            found = inspect(path, physics=physics, pixels=pixels)
        except NacreError as error:
            results.append({"file": str(path), "error": str(error)})
            continue
        facts = keyed(found.facts, found.units)
        about = {"summary": list(found.sentences), "looks_wrong": found.looks_wrong}
        results.append({"file": str(path), "kind": found.kind, **about, **facts})
        if found.brdf is not None:
            plotted.append((path, found.brdf))
        say(printable(path.resolve().name), style="bold")
        tell(found.sentences, indent=2)
        if session().verbose:
            print_facts("  figures", found.facts.items(), found.units)
    shown = any("error" not in result for result in results)
    if shown and not session().verbose and not session().as_json:
        note("-v shows all figures, --json gives them to scripts")
    if plot is not None and plotted:
        from nacre.figures.plot import lobe_figure, write_plot

        line("plotting", 0, 1)
        write_plot(lobe_figure(name_apart(plotted)), plot)
    report_parts(results, [f"{plot}: lobes in the plane of incidence"] if plot and plotted else [])
