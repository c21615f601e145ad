"""`nacre info`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.materials import kind_of, load_reflectance, load_texture
from nacre.cli.plot import check_count, name_apart
from nacre.cli.progress import progress
from nacre.cli.report import keyed, print_facts, report_parts
from nacre.cli.session import session
from nacre.errors import FormatError, NacreError

if TYPE_CHECKING:
    from nacre.brdf import Brdf
    from nacre.measured.textures.image_folder import Quantity

_UNITS = {
    "value range": "1/sr",
    "table range": "as stored",
    "invalid samples": "fraction of nodes",
    "points with a negative channel": "fraction of tabulated points",
    "points below the horizon": "fraction of tabulated points",
    "memory bytes": "bytes",
    "wavelengths nm": "nm",
    "bytes": "bytes",
    "training loss": "mean log-cosine loss",
    "held out loss": "mean log-cosine loss",
}
"""Units of the facts about a reflectance."""
_TEXTURE_UNITS = {
    "largest polar angle of lights": "degrees",
    "largest polar angle of views": "degrees",
    "value range": "reflectance factor",
    "mean value": "reflectance factor",
    "bytes as half floats": "bytes",
    "bytes": "bytes",
}
"""Units of the facts about a texture; values are of a sample of it."""


@make("info", writes=True, reports=True)
@options.inputs_argument("paths", metavar="INPUT...")
@options.option(
    "--physics/--no-physics",
    applies="brdf",
    default=True,
    help="Integrate energy, reciprocity and anisotropy.",
)
@options.option(
    "--plot",
    type=options.OUTPUT,
    help="Also plot the lobes of all reflectances (.png, .svg, .pdf).",
)
@options.pixels_option(applies="btf")
def command(
    paths: tuple[Path, ...], physics: bool, plot: Path | None, pixels: Quantity | None
) -> None:
    """Show what each INPUT holds, and whether a reflectance is physical.

    INPUT is a measured, analytic or neural reflectance, a texture (a file, a folder of images or a
    list of photographs), or another file of nacre: a code, a latent basis, a texture codec or a map
    of texels.
    """
    if plot is not None:
        from nacre.figures.plot import check_plot_path

        check_plot_path(plot)
        options.check_outputs([plot], paths)
        check_count(len(paths))
    results: list[dict[str, Any]] = []
    plotted: list[tuple[Path, Brdf]] = []
    line = progress("info")
    for index, path in enumerate(paths):
        line("reading", index, len(paths), path.name)
        try:
            kind, facts, units, brdf = _facts(path, physics, pixels, alone=len(paths) == 1)
        except NacreError as error:
            results.append({"file": str(path), "error": str(error)})
            continue
        results.append({"file": str(path), "kind": kind, **keyed(facts, units)})
        if brdf is not None:
            plotted.append((path, brdf))
        if not session().as_json:
            shown = {key: unit for key, unit in units.items() if key in facts and unit}
            print_facts(path.resolve().name, facts.items(), shown)
    if plot is not None and plotted:
        from nacre.figures.plot import lobe_figure, write_plot

        line("plotting", 0, 1)
        write_plot(lobe_figure(name_apart(plotted)), plot)
    report_parts(results, [f"{plot}: lobes in the plane of incidence"] if plot and plotted else [])


def _facts(
    path: Path, physics: bool, pixels: Quantity | None, *, alone: bool
) -> tuple[str, dict[str, Any], Mapping[str, str], Brdf | None]:
    """Kind, facts, their units, and the reflectance if it is one."""
    from nacre.io.tensors import has_header
    from nacre.textures.codecs.codec_file import KEY, codec_facts

    if has_header(path, KEY):
        if pixels is not None:
            raise FormatError(
                f"{path}: is a texture codec, which has no images; leave out --pixels"
            )
        return "codec", codec_facts(path), {"bytes": "bytes"}, None
    kind = kind_of(path, refusing=alone)
    if kind == "btf":
        return kind, _texture_facts(path, pixels), _TEXTURE_UNITS, None
    brdf = load_reflectance(path)
    facts, units = dict(brdf.describe()), dict(_UNITS)
    if physics:
        from nacre.metrics.facts import UNITS, physical_facts

        facts |= physical_facts(brdf)
        units |= UNITS
    facts["bytes"] = path.stat().st_size
    facts["sha256"] = (brdf.source or {}).get("sha256", "")
    return kind, facts, units, brdf


def _texture_facts(path: Path, pixels: Quantity | None) -> dict[str, Any]:
    from nacre.textures.formats import recognized
    from nacre.textures.selection import some_values

    btf = load_texture(path, pixels)
    values = some_values(btf)
    facts = btf.describe() | {
        "value range": [float(values.min()), float(values.max())],
        "mean value": [float(x) for x in values.mean(axis=0, dtype=float)],
        "format": recognized(path).name,
    }
    if path.is_file():
        facts["bytes"] = path.stat().st_size
    return facts
