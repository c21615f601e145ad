"""Mixtures of closures in the renderers that they are for, beside what they were fitted to.

Spheres of 128 pixels in the light and view of :mod:`nacre.render.sphere`, and in the museum: PSNR
of display values over the sphere, directional / environment.

- fit: the mixture, evaluated by nacre, against the table;
- Cycles, mixture: the OSL shader of closures, rendered by path tracing, against the mixture;
- Cycles, table: the same rendering against the table;
- MaterialX: the graph, in the GLSL that MaterialX generates, against the mixture; directional only.
"""

from __future__ import annotations

import math

import numpy as np

import nacre
from nacre.analytic import MODELS, fit
from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.color import tone_map
from nacre.export import TARGETS
from nacre.render.lights import DirectionalLight
from nacre.render.sphere import SIZE, frames, render_sphere, sphere_normals, standard_lights
from studies.parity import blender
from studies.parity.surface_shader import SurfaceShader
from studies.study import Study, log, museum, rgl_tables

_DIRECTIONS = 4096  # of the environment at a point: Cycles takes as many as it has samples
_COLUMNS = "fit", "Cycles, mixture", "Cycles, table", "MaterialX"


def psnr(image: Floats, truth: Floats) -> float:
    """Of display values over the sphere, dB."""
    inside = sphere_normals(SIZE)[1]
    squared = (tone_map(image[inside]) - tone_map(truth[inside])) ** 2
    return -10.0 * math.log10(float(squared.mean()))


def materialx(mixture: Brdf) -> Floats:
    """The sphere under the directional light, by the graph in GLSL."""
    document = TARGETS["materialx-closures"]().files(mixture, "mixture")["mixture.mtlx"]
    normals, inside = sphere_normals(SIZE)
    frame = frames(normals[inside])
    light = np.array(DirectionalLight.direction, np.float32)
    image = np.zeros((SIZE, SIZE, 3))
    reflected = SurfaceShader(document.decode()).radiance({}, light, frame[:, 2], frame[:, 0])
    lit = frame[:, 2] @ light > 0.0  # what the generator's own light does not ask
    image[inside] = np.where(lit[:, None], math.pi * reflected, 0.0)
    return image


def main() -> None:
    """Print a Markdown table."""
    study = Study(__doc__, __file__)
    study.add_argument("--samples", type=int, default=256, help="of a pixel in Cycles")
    options = study.options()
    environment = museum()
    lights = standard_lights(environment, _DIRECTIONS)
    rows = []
    for path in study.few(rgl_tables()):
        table = nacre.load(path)
        mixture = fit(table, MODELS["closures"])
        kinds = "directional", "environment"
        shown, truth = (
            [render_sphere(brdf, lights[kind])[0] for kind in kinds] for brdf in (mixture, table)
        )
        shader = TARGETS["osl-closures"]().files(mixture, "mixture")["mixture.osl"].decode()
        rendered = blender.closures(shader, SIZE, options.samples, environment.exposed())
        pairs = (shown, truth), (rendered, shown), (rendered, truth)
        cells = [
            " / ".join(f"{psnr(a, b):.1f}" for a, b in zip(*pair, strict=True)) for pair in pairs
        ]
        rows.append((path.stem, *cells, f"{psnr(materialx(mixture), shown[0]):.1f}"))
        log(*rows[-1])
    study.table(("PSNR in dB", *_COLUMNS), rows)


if __name__ == "__main__":
    main()
