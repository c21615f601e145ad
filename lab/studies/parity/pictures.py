"""A sphere of one material, by every tool that runs exports, beside Mitsuba's rendering.

`python -m lab.studies.parity.pictures -o docs/images` writes `export.png`: an orthographic view
under one directional light, 256x256, 16 points a pixel, whose reflectance each tool computes from
the exported files. Where Blender is there (`make parity-blender`), `export-cycles.png` is its
rendering of the exported shader. PSNR against Mitsuba is printed, for display values.
"""

from __future__ import annotations

from lab.studies.study import Study, log
from nacre.array import Floats
from nacre.color import tone_map
from nacre.figures.page import Page
from nacre.mitsuba.preview import write_bytes
from nacre.targets import TARGETS, identifier
from tests.oracles import blender
from tests.oracles.materials import MATERIALS, material
from tests.oracles.pictures import SIZE, executed, psnr, rendered
from tests.oracles.runner import RUNNERS

_DPI, _GAP, _COLUMNS = 100, 0.12, 4


def sheet(pictures: list[tuple[str, Floats]]) -> Page:
    """Pictures of spheres with captions, a few in a row."""
    side = SIZE / _DPI
    columns = min(len(pictures), _COLUMNS)
    rows = -(-len(pictures) // columns)
    height = side + 0.48
    page = Page(columns * (side + _GAP) + _GAP, rows * height + _GAP, dpi=_DPI)
    for k, (caption, picture) in enumerate(pictures):
        x, y = _GAP + k % columns * (side + _GAP), _GAP + k // columns * height
        page.image(x, y, side, side, tone_map(picture))
        page.text(x, y + side + 0.06, caption, va="top")
    return page


def main() -> None:
    """Write the pictures."""
    study = Study(__doc__, __file__)
    study.add_argument("--material", choices=MATERIALS, default="anisotropic")
    brdf = material(study.options().material)
    truth = rendered(brdf)
    pictures = [("Mitsuba", truth)]
    for name in RUNNERS:
        runner = RUNNERS[name]()
        missing = runner.missing()
        if missing:
            log(f"{runner.title}: {missing} is not installed")
            continue
        image = executed(runner, brdf)
        quality = f"{psnr(image, truth):.1f} dB"
        print(name, quality, flush=True)
        pictures.append((f"{runner.target}: {runner.title}\n{quality}", image))
    write_bytes(sheet(pictures).pixels(), study.output / "export.png")
    if blender.missing() is None:
        name = identifier(brdf.name)
        files = TARGETS["osl"]().files(brdf, name)
        image = blender.sphere(files[f"{name}.osl"].decode(), SIZE, 256)
        quality = f"{psnr(image, truth):.1f} dB"
        print("shader in Cycles", quality)
        both = [("Mitsuba", truth), (f"Cycles: the exported shader\n{quality}", image)]
        write_bytes(sheet(both).pixels(), study.output / "export-cycles.png")


if __name__ == "__main__":
    main()
