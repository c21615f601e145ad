"""A polished surface, which reflects in one direction only: no f_r can hold that.

Instruments that see the mirrored light take a :class:`Mirror` wherever they take a material, and
read it in closed form. Their scales begin with one: black glass is 100 gloss units.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nacre.analytic.fresnel import dielectric
from nacre.array import Doubles


@dataclass(frozen=True)
class Mirror:
    """A plane surface that mirrors, and scatters nothing.

    Parameters
    ----------
    index
        Refractive index of the dielectric below it, from 1; its reflectance is Fresnel's for
        unpolarized light. None for a surface that reflects everything.
    """

    index: float | None = None

    def reflectance(self, cosine: Doubles) -> Doubles:
        """From 0 to 1, for cosines of the incidence of any shape."""
        cosine = np.asarray(cosine, np.float64)
        if self.index is None:
            return np.ones_like(cosine)
        return np.asarray(dielectric(cosine, self.index))


BLACK_GLASS = Mirror(1.567)
"""Reads 100 gloss units at every angle: polished black glass of refractive index 1.567 at 587.6 nm
(ISO 2813:2014; ASTM D523)."""
