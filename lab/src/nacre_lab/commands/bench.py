from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import click

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.options import option
from nacre.cli.report import aside, counted, print_facts, progress, report, say


def _list(context: click.Context, _parameter: click.Parameter, value: bool) -> None:
    if not value or context.resilient_parsing:
        return
    from nacre_lab.benchmark.methods import SLOW, methods
    from nacre_lab.benchmark.protocol import MEASURES, PROTOCOLS
    from nacre_lab.benchmark.splits import splits

    print_facts("splits", [(name, split.about) for name, split in splits().items()])
    known = methods(PROTOCOLS["full"])
    print_facts("methods", [(name, method.about) for name, method in known.items()])
    print_facts("measures", [(key, measure.about) for key, measure in MEASURES.items()])
    say(f"\nmethods that take minutes, run only if named: {', '.join(SLOW)}")
    context.exit()


@make(
    "bench",
    options.argument("files", nargs=-1, metavar="[INPUT]..."),
    option("--split", metavar="NAME", default="included"),
    "Materials to test methods on; see --list.",
    option(
        "--methods",
        callback=options.names,
        metavar="NAME,NAME",
        shown="all but those that take minutes",
    ),
    "Methods to measure.",
    option("--only", multiple=True, metavar="NAME"),
    "Material to measure, by name; all of them without it. May be repeated.",
    option("--measured", options.INPUT),
    "Folder with the measured files of the split, as nacre download writes them.",
    options.output_option(required=False, shown="bench-SPLIT.jsonl, or bench-files.jsonl"),
    "Results file (.jsonl) to add rows to; existing rows are not measured again.",
    option("--quick", is_flag=True, help="Make short fits and small pictures for a first look."),
    option("--show", options.INPUT, multiple=True, metavar="FILE"),
    "Results file to print as a Markdown table instead of measuring. May be repeated.",
    option("--list", is_flag=True, is_eager=True, expose_value=False, callback=_list),
    "Print the names of all splits, methods and measures.",
    option("--cache", options.OUTPUT, group="repeated runs", shown="OUTPUT.cache"),
    "Folder for the trained latent bases.",
    option("--fresh", is_flag=True, group="repeated runs", help="Measure existing rows again."),
)
def command(
    files: tuple[Path, ...],
    split: str,
    methods: list[str],
    only: tuple[str, ...],
    measured: Path | None,
    output: Path | None,
    quick: bool,
    cache: Path | None,
    fresh: bool,
    show: tuple[Path, ...],
) -> None:
    """Measure representations of materials with the open benchmark, or print its results.

    Materials are those of a split, or your own: measured files, and folders of them. Every method
    is tried on every material, for bytes, errors of pictures, times, noise, reciprocity and energy.
    The results file has one line of JSON for each pair, with versions, machine and the command that
    repeats it. Lines are only added, and a stopped run resumes. Other packages can add methods: see
    lab/docs/benchmark.md.
    """
    if show:
        if files:
            raise click.UsageError("--show prints existing results; leave out the files to judge")
        _print_tables(show)
        return
    from nacre_lab.benchmark.run import run
    from nacre_lab.benchmark.splits import find_split, given

    label = "files" if files else split
    output = output or Path(f"bench-{label}.jsonl")
    if files:
        for name in ("split", "measured"):
            if options.is_given(name):
                raise click.UsageError(f"--{name} is for the splits of --list; leave it out")
        chosen = given(files, output, lambda path: aside(f"left out, not a measurement: {path}"))
    else:
        chosen = find_split(split)
    found = run(
        chosen,
        output,
        names=methods,
        only=only,
        folder=measured,
        protocol="quick" if quick else "full",
        cache=cache,
        fresh=fresh,
        progress=progress(label),
    )
    missing = [row for row in found.rows if row.unavailable is not None]
    for row in missing:
        aside(f"left out: {row.method} for {row.material}: {row.unavailable}")
    kept = len(found.rows) - found.measured
    new = counted(found.measured, "row measured", "rows measured")
    line = f"{output}: {new}, {kept:,} there already, {len(missing):,} without a result"
    report(line, {"output": str(output), "rows": [asdict(row) for row in found.rows]})


def _print_tables(paths: tuple[Path, ...]) -> None:
    from nacre.errors import FormatError
    from nacre_lab.benchmark.results import read_results
    from nacre_lab.benchmark.table import markdown

    for other, flag in options.given():
        if other.name != "show":
            raise click.UsageError(f"--show prints existing results; leave out {flag}")
    rows = []
    for path in paths:
        found = read_results(path)
        if not found:
            raise FormatError(f"{path}: has no complete row")
        rows += found
    report(markdown(rows).splitlines(), [asdict(row) for row in rows])
