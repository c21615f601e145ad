"""Every analytic model, by the name it has in files and on the command line."""

from __future__ import annotations

from nacre.analytic.ggx import AnisotropicGgx, Ggx
from nacre.analytic.model import AnalyticBrdf

MODELS: dict[str, type[AnalyticBrdf]] = {kind.model: kind for kind in (Ggx, AnisotropicGgx)}
