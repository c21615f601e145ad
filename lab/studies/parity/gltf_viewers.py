"""The table of :mod:`tests.oracles.gltf_viewers`: glTF's model against viewers that draw it."""

from __future__ import annotations

from typing import Any

import numpy as np

from lab.studies.study import Study
from tests.oracles.gltf_viewers import LAYERS, errors, lights, made, sheen_albedo
from tests.oracles.runners import gltf


def main() -> None:
    """Make the table."""
    study = Study(__doc__, __file__)
    options = study.options()
    directions, table = lights(2 if options.quick else 6), sheen_albedo()
    rows = []
    for name, layers in LAYERS.items():
        materials = [made(seed, layers) for seed in range(2 if options.quick else 6)]
        ways: dict[str, tuple[gltf.Viewer, dict[str, Any]]] = {
            "Khronos": ("khronos", {"sheen_albedo": table}),
            "Khronos, edited": ("khronos", {"sheen_albedo": table, "edits": gltf.AS_WRITTEN}),
            "three.js": ("three", {}),
            "three.js, single scattering": ("three", {"edits": [gltf.NO_COMPENSATION]}),
        }
        for title, (viewer, more) in ways.items():
            found = errors(viewer, materials, directions, **more)
            quantiles = np.quantile(found, (0.5, 0.99, 1.0))
            rows.append((name, title, *(f"{value:.1e}" for value in quantiles)))
    study.table(("material", "viewer", "median", "99 %", "max"), rows)


if __name__ == "__main__":
    main()
