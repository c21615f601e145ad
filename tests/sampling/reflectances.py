"""Reflectances to fit samplers to."""

from __future__ import annotations

import math

import numpy as np

from nacre.brdf import Brdf
from nacre.geometry import half_vector


class Shiny(Brdf):
    """Diffuse plus a Blinn-Phong highlight, of known parameters."""

    def __init__(self, diffuse: float, specular: float, exponent: float) -> None:
        self.diffuse, self.specular, self.exponent = diffuse, specular, exponent

    def eval_components(self, wi, wo):
        lobe = np.maximum(half_vector(wi, wo)[2], 1e-9) ** self.exponent
        value = self.diffuse / math.pi + self.specular * (self.exponent + 2) / 8 * lobe / math.pi
        return value, value, value
