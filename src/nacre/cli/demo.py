from __future__ import annotations

import dataclasses
import os
from pathlib import Path

import numpy as np
import numpy.typing as npt

from nacre.brdf import Brdf
from nacre.cli import options
from nacre.cli.command import command as make
from nacre.cli.compare import conclude, print_comparison
from nacre.cli.display import Line
from nacre.cli.options import option
from nacre.cli.ranges import IntRange
from nacre.cli.report import print_facts, progress, say
from nacre.errors import FormatError

_MATERIAL = {
    "type": "principled",
    "base_color": {"type": "rgb", "value": [0.45, 0.07, 0.03]},
    "roughness": 0.45,
    "metallic": 0.6,
    "specular": 0.5,
    "clearcoat": 0.8,
    "clearcoat_gloss": 0.85,
}
"""A copper-colored car paint under a clear coat."""


@make(
    "demo",
    options.argument("source", metavar="[INPUT]", required=False),
    options.output_option(required=False, default="out/demo.png"),
    "Picture to write; the other files go beside it.",
    options.preset_option(),
    option("--spp", IntRange(1), default=128, help="Samples per pixel."),
    reports=False,
)
def command(source: Path | None, output: Path, preset: str, spp: int) -> None:
    """Measure, fit, save, render and compare one material.

    The material is INPUT, or the file that NACRE_DATA names (in a folder, the first RGL table), or
    a virtual measurement of a Mitsuba material, saved as a table on MERL's grid.
    """
    from nacre.figures import picture
    from nacre.formats import load_brdf, save
    from nacre.measuring.virtual import MitsubaBrdf
    from nacre.metrics import compare
    from nacre.mitsuba.preview import DISPLAY_IMAGES, check_image_path, write_bytes
    from nacre.neural import Recipe, fit

    check_image_path(output, DISPLAY_IMAGES)
    output.parent.mkdir(parents=True, exist_ok=True)
    named = source or _from_environment()
    path = named or output.with_name(f"{output.stem}_measured.npz")
    target = output.with_name(f"{output.stem}_neural.safetensors")
    made = [output, target] if named else [output, target, path]
    options.check_outputs(made, [named])
    report = progress(path.stem)
    if named is None:
        report("measuring", 0, 1)
        save(MitsubaBrdf(_MATERIAL, "virtual car paint"), path)
    truth = load_brdf(path)
    network = fit(truth, Recipe.preset(preset), progress=report)
    save(network, target)
    neural = load_brdf(target)
    report("comparing", 0, 100)
    comparison = compare(truth, neural, progress=report.parts("comparing"))
    views = _view(truth, spp, report), _view(neural, spp, report)
    comparison = dataclasses.replace(comparison, truth=path.name, other=target.name)
    write_bytes(picture(comparison, views), output)
    print_facts(f"{path} (measured)", truth.describe().items())
    print_facts(f"{target} (neural)", neural.describe().items())
    print_comparison(comparison)
    say(f"Look at {output}: measured | neural | difference; path traced below")
    conclude(comparison.verdict)


def _from_environment() -> Path | None:
    """The file that NACRE_DATA names, or the first RGL table in that folder."""
    named = os.environ.get("NACRE_DATA")
    if not named:
        return None
    path = Path(named)
    if path.is_dir():
        tables = sorted([*path.glob("*.bsdf"), *path.glob("rgl/*.bsdf")])
        if not tables:
            raise FormatError(f"{path}: NACRE_DATA names a folder without .bsdf files")
        return tables[0]
    return path


def _view(brdf: Brdf, spp: int, report: Line) -> npt.NDArray[np.float32]:
    from nacre.mitsuba.preview import render_preview

    show = report.parts(f"rendering {type(brdf).__name__}", spp)
    show(0)
    return render_preview(brdf, spp=spp, progress=show)
