from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.options import option
from nacre.cli.ranges import IntRange
from nacre.cli.report import print_table, progress, report

if TYPE_CHECKING:
    from nacre.latent import CodedBrdf, LatentBasis
    from nacre.runtime.progress import Progress

_ALONG = "rougher", "glossier-coat", "darker", "more-saturated", "more-metallic"


@make(
    "interpolate",
    options.argument("first"),
    options.argument("second", required=False),
    options.output_option("Picture to write (.png, .jpg); a page of sliders (.html)."),
    options.basis_option(),
    option("--along", _ALONG, multiple=True),
    "Direction to change FIRST in, both ways, instead of SECOND. May be repeated, for one row or "
    "slider each; a page has all by default.",
    option("--count", IntRange(2, 64), default=5, help="Number of materials, with both ends."),
    option("--codes", options.OUTPUT, help="Folder for the codes of all (.json)."),
    options.picture_size_option(),
    options.spp_option(),
)
def command(
    first: Path,
    second: Path | None,
    output: Path,
    basis_name: str,
    along: tuple[str, ...],
    count: int,
    codes: Path | None,
    size: int,
    spp: int | None,
) -> None:
    """Render what lies between FIRST and SECOND, which are materials or codes (.json).

    In pca and neural bases the logarithm of f_r is linear in the code, so that materials in between
    never reflect more than the same mixture of the ends.

    With --along, render FIRST as it becomes rougher, more metallic and so on.
    """
    from nacre.latent import find_basis
    from nacre.mitsuba.preview import DISPLAY_IMAGES, check_image_path

    page = output.suffix.lower() == ".html"
    if not page:
        check_image_path(output, DISPLAY_IMAGES)
    if (second is None) != (page or bool(along)):
        wanted = "no SECOND" if second else "SECOND, or a direction with --along"
        raise click.UsageError(f"expected {wanted}: {output} shows one or the other")
    options.check_outputs([output], [first, second, Path(basis_name)])
    line = progress(output.stem, "encoding")
    basis = find_basis(basis_name)
    if second is not None:
        _between(basis, first, second, output, count, codes, (size, spp), line)
    else:
        _along(basis, first, along or _ALONG, output, count, codes, (size, spp), line)


def _between(
    basis: LatentBasis,
    first: Path,
    second: Path,
    output: Path,
    count: int,
    codes: Path | None,
    picture: tuple[int, int | None],
    line: Progress,
) -> None:
    from nacre.figures.code_views import between, coded, strip
    from nacre.metrics import albedo
    from nacre.mitsuba.preview import write_bytes

    ends = coded([first, second], basis)
    materials = between(ends[0], ends[1], count)
    _save(codes, [("", materials)])
    write_bytes(strip(materials, *picture, line), output)
    rows = [
        (index / (count - 1), [float(x) for x in albedo(material, [0.0]).value[0]])
        for index, material in enumerate(materials)
    ]
    columns = ("fraction of the second", "albedo, red", "green", "blue")
    print_table(columns, ((f"{part:.2f}", *(f"{x:.3f}" for x in rgb)) for part, rgb in rows))
    data = [{"fraction": fraction, "albedo": albedos} for fraction, albedos in rows]
    report(f"{output}: {count} materials", {"output": str(output), "materials": data})


def _along(
    basis: LatentBasis,
    first: Path,
    along: Sequence[str],
    output: Path,
    count: int,
    codes: Path | None,
    picture: tuple[int, int | None],
    line: Progress,
) -> None:
    """What a material becomes along named directions, one row or slider each."""
    from nacre.figures.code_views import coded, strip
    from nacre.figures.sliders import moved, slider_page
    from nacre.io.files import atomic_path
    from nacre.latent.edits import edits
    from nacre.mitsuba.preview import write_bytes
    from nacre.workflows import plausibility

    material = coded([first], basis)[0]
    known = edits(basis, line)
    chosen = [known[name.replace("-", " ")] for name in dict.fromkeys(along)]
    rows = [moved(material, edit, count) for edit in chosen]
    facts = {each.name: plausibility(each) for row in rows for each in row}
    _save(codes, [(f"{e.name.replace(' ', '-')}-", r) for e, r in zip(chosen, rows, strict=True)])

    def caption(each: CodedBrdf) -> str:
        fact = facts[each.name]
        typical, light = 100.0 * fact.typical, ", makes light" if fact.albedo > 1.0 else ""
        return f"more plausible than {typical:.0f} %, largest albedo {fact.albedo:.2f}{light}"

    if output.suffix.lower() == ".html":
        content = slider_page(material.name, chosen, rows, caption, *picture, line)
        with atomic_path(output) as temporary:
            temporary.write_bytes(content)
    else:
        every = [each for row in rows for each in row]
        write_bytes(strip(every, *picture, line, columns=count), output)
    lines: list[tuple[str, ...]] = []
    data: list[dict[str, Any]] = []
    for edit, row in zip(chosen, rows, strict=True):
        for each in row:
            amount, fact = each.name.rpartition(" ")[2], facts[each.name]
            typical = f"{100.0 * fact.typical:.0f} %"
            lines.append((edit.name, amount, typical, f"{fact.albedo:.3f}"))
            data.append({"along": edit.name, "amount": float(amount), "albedo": fact.albedo})
            data[-1]["typical"] = fact.typical
    print_table(("along", "amount", "more plausible than", "largest albedo"), lines)
    report(f"{output}: {len(lines)} materials", {"output": str(output), "materials": data})


def _save(folder: Path | None, rows: Sequence[tuple[str, Sequence[CodedBrdf]]]) -> None:
    """Write the codes of rows of materials; file names are a prefix and a number."""
    from nacre.latent import save_code

    if folder is None:
        return
    folder.mkdir(parents=True, exist_ok=True)
    for prefix, materials in rows:
        for index, material in enumerate(materials):
            save_code(material, folder / f"{prefix}{index:02d}.json")
