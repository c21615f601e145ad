from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.options import option
from nacre.cli.ranges import IntRange
from nacre.cli.report import fail, print_table, progress, report, say, tell
from nacre.errors import NacreError, reason

if TYPE_CHECKING:
    from nacre.soundness import Report


@make(
    "check",
    options.argument("given", options.TEXT, nargs=-1, required=True, metavar="INPUT..."),
    options.output_option("Page with a picture for each property (.html).", required=False),
    option("--only", metavar="NAME,NAME", callback=options.names),
    "Properties to check: finite, positive, energy, reciprocity, no-cosine, isotropy, weights, "
    "coverage, normalization, chi-square, area, gradients, variants.",
    option("--bsdf name", metavar="ID"),
    "BSDF to check in a scene that has several.",
    option("--samples", IntRange(1000, 100_000_000), default=1 << 17),
    "Directions drawn for each of five views where densities are compared with samples.",
    option("--import modules", metavar="MODULE", multiple=True),
    "Python module to import first, which registers BSDFs with Mitsuba.",
    options.seed_option(),
)
def command(
    given: tuple[str, ...],
    output: Path | None,
    only: list[str],
    name: str | None,
    samples: int,
    modules: tuple[str, ...],
    seed: int,
) -> None:
    """Check whether each INPUT is sound: reciprocity, energy, densities, derivatives and more.

    INPUT is a material's file or name; a Mitsuba scene, scene.xml#id for one of several BSDFs; the
    name of a BSDF of Mitsuba, such as roughconductor; a description for mitsuba.load_dict in JSON;
    or what nacre export --to c wrote (.c, .h), which is compiled and run. The exit code is 1 if a
    property fails. Properties that a kind of material need not have are named as by design, and do
    not count.
    """
    from nacre.soundness.table import check_names
    from nacre.verbs.checking import check, check_page_path, write_page

    check_names(only)
    if output is not None:
        check_page_path(output)
        paths = [Path(text.partition("#")[0]) for text in given]
        options.check_outputs([output], [path for path in paths if path.exists()])
    _import(modules)
    reports: list[Report] = []
    facts: list[dict[str, Any]] = []
    for text in given:
        line = progress(Path(text).name[:40])
        try:
            found = check(
                text, only=only, bsdf=name, samples=samples, seed=seed, progress=line
            ).report
        except NacreError as error:
            if len(given) == 1:
                raise
            facts.append({"input": text, "error": str(error)})
            continue
        finally:
            line.end()
        reports.append(found)
        facts.append({"input": text, **found.facts()})
        _print(found)
    if output is not None and reports:
        write_page(reports, output)
    lines = [f"{output}: a picture for each property"] if output is not None and reports else []
    report(lines, facts)
    errors = [str(each["error"]) for each in facts if "error" in each]
    for message in errors:
        fail(message)
    if errors and not reports:
        raise SystemExit(2)
    if errors or not all(found.sound for found in reports):
        raise SystemExit(1)


def _import(modules: tuple[str, ...]) -> None:
    """Import modules by name. Raises NacreError for one that does not load."""
    import importlib
    import sys

    sys.path.insert(0, "")
    try:
        for module in modules:
            try:
                importlib.import_module(module)
            except Exception as error:  # whatever its code raises
                raise NacreError(f"--import {module}: does not load: {reason(error)}") from error
    finally:
        sys.path.remove("")


def _print(found: Report) -> None:
    from nacre.verbs.checking import verdict

    say(f"{found.name} {verdict(found)}", style="bold")
    rows = [
        (each.property, *("" if x is None else f"{x:.3g}" for x in (each.size, each.limit)),
         each.state)
        for each in found.results
    ]  # fmt: skip
    print_table(("property", "size", "limit", "state"), rows, texts=1)
    for each in found.results:
        if each.state in ("failed", "by design"):
            where = "" if each.where is None else f" Worst at {each.where}."
            tell([f"{each.property}: {each.sentence}{where}"])
    say("")
