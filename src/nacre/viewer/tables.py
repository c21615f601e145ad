"""Tables as the page stores them (`tables.js`): grids of half floats, as on graphics cards.

The page converts files that are dropped onto it in the same way, so that both look alike.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.brdf import Brdf
from nacre.io.tensors import HALF_LARGEST
from nacre.measured import rgl, rgl_writer
from nacre.measured.mbsdf_table import MbsdfBrdf
from nacre.measured.merl import INVALID, Resolution, tabulate
from nacre.measured.merl_table import SCALES, MerlBrdf
from nacre.measured.rgl import RglBrdf
from nacre.sampling import GgxLobe, GgxMixture

_LOBES = {0.5: 0.2, 0.2: 0.2, 0.08: 0.15, 0.03: 0.1}  # fraction of the samples by roughness

SAMPLER = GgxMixture(
    tuple(GgxLobe((part,), (alpha,), (alpha,), (0.0,)) for alpha, part in _LOBES.items()),
    uniform=(0.0,),
    squared=(0.0,),
    cosines=(1.0,),
)
"""The sampler for all tables: lobes from dull to glossy, and a cosine lobe that covers every
direction. Files that are dropped onto the page leave no time for a fit."""


@dataclass(frozen=True)
class Grid:
    """Numbers in a 3-D texture, float16 or float32.

    They have shape (depth, height, width), with one more axis for 3 channels.
    """

    values: npt.NDArray[np.floating]
    channels: int = 1

    def facts(self) -> dict[str, Any]:
        """Facts for the page besides the numbers."""
        size = self.values.shape[2::-1]
        half = self.values.dtype == np.float16
        return {"size": list(size), "channels": self.channels, "half": half}


@dataclass(frozen=True)
class Table:
    """A table for the page, with grids by their names in the page's shaders.

    Its facts are its kind, the `scale` from half floats to f_r, and others for the kind.
    """

    facts: Mapping[str, Any]
    grids: Mapping[str, Grid]


def as_table(brdf: Brdf) -> Table | None:
    """A measured table in the page's format; None for any other reflectance."""
    if isinstance(brdf, MerlBrdf):
        return _merl(brdf)
    if isinstance(brdf, MbsdfBrdf):
        scale, values = halves(brdf.stored)
        return Table({"kind": "mbsdf", "scale": scale}, {"nodes": Grid(values, values.shape[3])})
    return _rgl(brdf) if isinstance(brdf, RglBrdf) else None


def tabulated(brdf: Brdf) -> Table:
    """A table of a reflectance that has no formula, as scattered samples have none.

    It has nodes in the Rusinkiewicz angles, or, for an anisotropic one, of views.
    """
    if brdf.isotropic:
        return _merl(tabulate(brdf, Resolution(60, 30, 45)))
    return _rgl(rgl.tabulate(brdf, rgl_writer.Resolution(17, 8, 20, 16, 16)))


def halves(values: npt.NDArray[np.floating]) -> tuple[float, npt.NDArray[np.float16]]:
    """Numbers as half floats times the smallest power of two that lets the largest fit."""
    largest = float(np.abs(values).max())
    power = math.ceil(math.log2(largest / HALF_LARGEST)) if largest else 0
    scale = 2.0 ** min(max(power, -100), 127)
    return scale, (values / np.float32(scale)).astype(np.float16)


def _merl(brdf: MerlBrdf) -> Table:
    f_r = (np.moveaxis(brdf.stored, 0, -1) * np.asarray(SCALES)).astype(np.float32)
    invalid = ~brdf.mask
    f_r[invalid] = 0.0
    scale, values = halves(f_r)
    values[invalid] = INVALID
    facts = {"kind": "merl", "scale": scale, "nearest": brdf.interpolation == "nearest"}
    return Table(facts, {"nodes": Grid(values, 3)})


def _rgl(brdf: RglBrdf) -> Table:
    tables = brdf.tables
    _, _, _, height, width = tables.rgb.shape
    scale, colors = halves(np.moveaxis(tables.rgb, 2, -1).reshape(-1, height, width, 3))
    single = {
        "phi": tables.phi_i[None, None],
        "theta": tables.theta_i[None, None],
        "ndf": tables.ndf[None],
        "sigma": tables.sigma[None],
        "vndf": tables.vndf.reshape(-1, *tables.vndf.shape[2:]),
    }
    facts = {
        "kind": "rgl",
        "scale": scale,
        "jacobian": tables.jacobian,
        "isotropic": tables.isotropic,
        "reduction": tables.reduction,
    }
    return Table(facts, {**{k: Grid(v) for k, v in single.items()}, "rgb": Grid(colors, 3)})
