"""A sphere of one material, by every tool that runs exports, beside Mitsuba's rendering.

`python -m studies.parity.pictures -o docs/images` writes `export.png`: an orthographic view under
one directional light, 256x256, 16 points a pixel, whose reflectance each tool computes from the
exported files. Where Blender is there (`make parity-blender`), `export-cycles.png` is its rendering
of the exported shader. PSNR against Mitsuba is printed, for display values.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.color import tone_map
from nacre.export import TARGETS, identifier
from nacre.figures.page import Page
from nacre.render.engine import mitsuba
from nacre.render.lights import DirectionalLight
from nacre.render.plugins import bsdf
from nacre.render.preview import render_scene, write_bytes
from nacre.render.scene import directional, path_traced
from nacre.render.sphere import MARGIN, frames, sphere_normals
from studies.parity import blender
from studies.parity.materials import MATERIALS, material
from studies.parity.runner import RUNNERS, Runner
from studies.study import Study, log

SIZE = 256
_POINTS = 4  # along an edge of a pixel
_DPI, _GAP, _COLUMNS = 100, 0.12, 4


def executed(runner: Runner, brdf: Brdf, size: int = SIZE) -> Floats:
    """The sphere with the reflectance that a runner computes, linear RGB (size, size, 3)."""
    shifts = (np.arange(_POINTS) + 0.5) / _POINTS - 0.5
    grid = [sphere_normals(size, np.array([x, y])) for y in shifts for x in shifts]
    light = DirectionalLight()
    image = np.zeros((size * size, 3))
    places, given = [], []
    for normals, mask in grid:
        local = frames(normals[mask])
        wi, _, points = light.incident(local)
        places.append(np.flatnonzero(mask)[points])
        given.append((wi, local[points, :, 2]))
    wi, wo = (np.concatenate(part).astype(np.float32) for part in zip(*given, strict=True))
    name = identifier(brdf.name)
    f = runner.run(TARGETS[runner.target]().files(brdf, name), name, "eval", wi, wo)
    np.add.at(image, np.concatenate(places), f * wi[:, 2:] * (math.pi / len(grid)))
    return image.reshape(size, size, 3)


def rendered(
    brdf: Brdf, size: int = SIZE, spp: int = 256, light: Mapping[str, Any] | None = None
) -> Floats:
    """The sphere by Mitsuba, linear RGB (size, size, 3); under a directional light if None."""
    mi = mitsuba()
    transform = mi.ScalarTransform4f
    half = 1.0 / (1.0 - MARGIN)
    sensor = {
        "type": "orthographic",
        "to_world": transform().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0]).scale([half, half, 1]),
        "film": {
            "type": "hdrfilm",
            "width": size,
            "height": size,
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
    }
    upright = transform().rotate([1, 0, 0], -90.0)
    scene = {
        **path_traced(2, sensor),
        "light": light or directional(DirectionalLight.direction),
        "sphere": {"type": "sphere", "to_world": upright, "bsdf": bsdf(brdf)},
    }
    return render_scene(scene, spp)


def psnr(image: Floats, truth: Floats) -> float:
    """Peak signal-to-noise ratio of display values in dB."""
    return -10.0 * math.log10(float(np.mean((tone_map(image) - tone_map(truth)) ** 2)))


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
