"""The table of :mod:`tests.oracles.openpbr`: OpenPBR's formula against MaterialX's GLSL.

The last rows have the haze of version 1.2 (:mod:`lab.studies.references.hazy_graph`).
"""

from __future__ import annotations

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
    rows = []
    comparisons = (
        *(Comparison(model, options.seed) for model in (OpenPbr, AnisotropicOpenPbr)),
        Comparison(HazyOpenPbr, options.seed, shader),
    )
    for comparison in comparisons:
        for name, given in {**{k: {**BARE, **v} for k, v in PARTS.items()}, "all": {}}.items():
            errors = comparison.errors(given, materials)
            numbers = str(len(errors)), f"{np.median(errors):.1e}", f"{errors.max():.1e}"
            rows.append([f"{comparison.model.model}: {name}", *numbers])
    study.table(("relative error", "values", "median", "max"), rows)


if __name__ == "__main__":
    main()
