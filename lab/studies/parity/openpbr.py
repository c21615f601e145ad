"""The table of :mod:`tests.oracles.openpbr`: OpenPBR's formula against MaterialX's GLSL.

The haze of version 1.2 is that of :mod:`lab.studies.references.hazy_graph`. The last rows are its
graph as MaterialX evaluates it by default.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from lab.studies.references.hazy_graph import shader
from lab.studies.references.hazy_openpbr import HazyOpenPbr
from lab.studies.study import Study
from nacre.standard.openpbr import AnisotropicOpenPbr, OpenPbr
from tests.oracles.openpbr import BARE, PARTS, Comparison


def main() -> None:
    """Write a table of errors by layer."""
    study = Study(__doc__, __file__)
    options = study.options()
    materials = 10 if options.quick else 100
    hazy = {"openpbr-haze": shader, "the same, by default": partial(shader, plain_mixes=False)}
    comparisons: dict[str, Comparison[Any]] = {
        **{model.model: Comparison(model, options.seed) for model in (OpenPbr, AnisotropicOpenPbr)},
        **{name: Comparison(HazyOpenPbr, options.seed, made) for name, made in hazy.items()},
    }
    rows = []
    for title, comparison in comparisons.items():
        for name, given in {**{k: {**BARE, **v} for k, v in PARTS.items()}, "all": {}}.items():
            errors = comparison.errors(given, materials)
            numbers = str(len(errors)), f"{np.median(errors):.1e}", f"{errors.max():.1e}"
            rows.append([f"{title}: {name}", *numbers])
    study.table(("relative error", "values", "median", "max"), rows)


if __name__ == "__main__":
    main()
