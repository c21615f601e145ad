"""Mixtures of closures in the renderers that they are for, beside what they were fitted to.

Spheres of 128 pixels in the light and view of :mod:`nacre.mitsuba.sphere`, and in the museum: PSNR
of display values over the sphere, directional / environment.

- fit: the mixture, evaluated by nacre, against the table;
- Cycles, mixture: the OSL shader of closures, rendered by path tracing, against the mixture;
- Cycles, table: the same rendering against the table;
- MaterialX: the graph, in the GLSL that MaterialX generates, against the mixture; directional only.
"""

from __future__ import annotations

import nacre
from lab.studies.study import Study, log, museum, rgl_tables
from nacre.analytic import MODELS, fit
from nacre.mitsuba.sphere import SIZE, render_sphere, standard_lights
from nacre.targets import TARGETS
from tests.oracles import blender
from tests.oracles.closures import materialx, psnr

_DIRECTIONS = 4096  # of the environment at a point: Cycles takes as many as it has samples
_COLUMNS = "fit", "Cycles, mixture", "Cycles, table", "MaterialX"


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
