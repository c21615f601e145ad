"""The Principled node of Cycles and ours, at random parameters and directions.

NACRE_BLENDER_PYTHON=... python -m lab.studies.parity.principled [COUNT]
"""

from __future__ import annotations

import sys

import numpy as np

from tests.oracles.principled import CASES, VIEWS, case, furnace

_SAMPLES = 1024  # of the sky, per pixel


def main() -> None:
    """Print the agreement with everything at random, and of each layer alone."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 4096
    random = np.random.default_rng(0)
    print(f"{'':24s}   median     95 %      max")
    for name in CASES:
        rows = np.quantile(case(name, count, random), (0.5, 0.95, 1.0))
        print(f"{name:24s} " + " ".join(f"{100 * x:7.3f}%" for x in rows))
    sky, here = furnace(count // 4, _SAMPLES, random)
    for view, theirs, mine in zip(VIEWS, sky, here, strict=True):
        print(f"mean albedo at {view}: {theirs.mean():.4f} in Cycles' furnace, {mine.mean():.4f}")
    print(f"standard deviation of the difference, {_SAMPLES} samples: {(sky - here).std():.4f}")


if __name__ == "__main__":
    main()
