"""Reflectances that tests of several parts share."""

from __future__ import annotations

import numpy as np

from nacre.brdf import Brdf
from nacre.geometry import half_vector
from tests.oracles.reflectances import Beckmann, Glossy, Rotated

__all__ = ["Beckmann", "Brushed", "Glossy", "Rotated"]


class Brushed(Brdf):
    """A highlight that is long across x."""

    isotropic = False

    def eval_components(self, wi, wo):
        h = half_vector(wi, wo)
        lobe = np.exp(-((h[0] * 4) ** 2) - (h[1] * 1.5) ** 2)
        return 0.05 + lobe, 0.05 + 0.8 * lobe, 0.05 + 0.5 * lobe
