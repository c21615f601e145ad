"""One material as itself, network, closure mixture in Cycles, OpenPBR and glTF, under two lights.

    NACRE_BLENDER_PYTHON=... python -m lab.studies.parity.standard_pictures -o docs/images
    ... -m lab.studies.parity.standard_pictures carpaint_red.mbsdf --name carpaint -o docs/images

Writes one picture: the sphere of :mod:`nacre.mitsuba.sphere`. The closure mixture is rendered by
Cycles of the exported script, the others by their formulas, which other programs have checked. PSNR
and FLIP are of the material itself.
"""

from __future__ import annotations

import sys
from pathlib import Path

import nacre
from lab.studies.parity.mixture_in_cycles import DIRECTIONS, in_cycles
from lab.studies.study import Study, data, log, museum
from nacre.array import Weights
from nacre.color import tone_map
from nacre.figures.page import Page
from nacre.metrics.metrics import image_errors
from nacre.mitsuba.preview import write_bytes
from nacre.mitsuba.sphere import render_sphere, standard_lights
from nacre.standard.closures import Closures
from nacre.standard.fitted import fitted
from nacre.standard.gltf import Gltf
from nacre.standard.openpbr import OpenPbr
from tests.oracles import blender

_SIDE, _GAP = 1.9, 0.1  # inches


def main() -> None:
    """Write the picture."""
    study = Study(__doc__, __file__)
    default = data("rgl", "satin_rosaline_rgb.bsdf")
    study.add_argument("file", nargs="?", type=Path, default=default, help="material")
    study.add_argument("--name", default="standard", help="of the picture's file, without .png")
    study.add_argument("--samples", type=int, default=1024, help="of Cycles a pixel")
    options = study.options()
    if missing := blender.missing():
        sys.exit(f"{missing} is not there")
    brdf, environment = nacre.load(options.file), museum()
    mixture = fitted(brdf, Closures)
    cycles = in_cycles(mixture, environment.exposed().pixels, options.samples)
    others = {
        "network": nacre.fit(brdf),
        "closures, in Cycles": mixture,
        "OpenPBR": fitted(brdf, OpenPbr),
        "glTF": fitted(brdf, Gltf),
    }
    page = Page((_SIDE + _GAP) * (1 + len(others)) + _GAP, (_SIDE + 0.42) * 2 + _GAP, dpi=100)
    for row, (name, light) in enumerate(standard_lights(environment, DIRECTIONS).items()):
        truth, mask = render_sphere(brdf, light)
        y = _GAP + row * (_SIDE + 0.42)
        _show(page, 0, y, truth, f"measured\n{name} light")
        for column, (title, other) in enumerate(others.items(), 1):
            picture: Weights
            if other is mixture:
                picture = cycles[name] * mask[..., None]
            else:
                picture, _ = render_sphere(other, light)
            errors, _ = image_errors(truth, picture, mask)
            log(name, title, f"{errors.psnr:.1f} dB, FLIP {errors.flip:.3f}")
            _show(page, column, y, picture, f"{title}\n{errors.psnr:.1f} dB, {errors.flip:.3f}")
    write_bytes(page.pixels(), study.output / f"{options.name}.png")


def _show(page: Page, column: int, y: float, picture: Weights, caption: str) -> None:
    x = _GAP + column * (_SIDE + _GAP)
    page.image(x, y, _SIDE, _SIDE, tone_map(picture))
    page.text(x, y + _SIDE + 0.05, caption, va="top")


if __name__ == "__main__":
    main()
