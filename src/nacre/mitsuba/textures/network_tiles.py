"""Sizes of what :mod:`nacre.mitsuba.textures.network_loops` works on, on this processor."""

from __future__ import annotations

import llvmlite.binding

from nacre.compile.vector_code import LANES

VECTORS = 2
HITS = VECTORS * LANES
"""That go through a network together: what layers give stays in the first cache."""
ROWS = 12 if LANES == 16 or llvmlite.binding.get_host_cpu_features().get("neon") else 6
"""Outputs of a layer whose sums stay in registers."""
