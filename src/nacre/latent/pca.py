"""Principal components of log-relative reflectance.

Nielsen, Jensen and Ramamoorthi 2015, "On Optimal, Minimal BRDF Sampling for Reflectance
Acquisition". A reflectance f on the grid of the MERL database is seen as

    ln((f w + e) / (m w + e)),    w = max(cos theta_i cos theta_o, e),    e = 0.001,

where m w is the median of f w over the training materials. From this their mean is taken off and
the principal components of what is left describe it. The median drops out of that difference: what
a basis keeps is its logarithm and the mean in one, which is the mean of ln(f w + e).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.latent.codes import LARGEST, checked_code, code_facts
from nacre.measured.merl import INVALID, Resolution, node_directions, tabulate
from nacre.measured.merl_table import SCALES, MerlBrdf

Floats = npt.NDArray[np.floating]
Mask = npt.NDArray[np.bool_]

EPSILON = 1e-3
"""Added before logarithms, and the least weight of a node (Nielsen et al. 2015)."""

_BRIGHTEST = math.log(1e6)
"""Bound of ln(f w + e): whatever a code holds, what it stands for is finite."""
_RIDGE = 1e-9
"""Pull of the code to zero, relative to the weight of all nodes: settles what no node tells."""


@dataclass(frozen=True, eq=False)
class Basis:
    """Principal components over the nodes of a grid at which every training material is known.

    A material is a code of k values. ln(f w + e) at a node is the center plus, for each value, the
    product of the value, its standard deviation, a component and a color. Components belong to
    one channel, so they are shared: see :func:`nacre.latent.training.train`.

    Parameters
    ----------
    resolution
        Of the grid.
    mask
        Nodes that take part, shape (theta_h, theta_d, phi_d).
    center
        Mean of ln(f w + e) over training materials and channels, shape (nodes,), float32.
    components
        Shape (components, nodes), float32; their products with the colors are orthonormal.
    uses
        Which component a value of the code is for, shape (k,).
    colors
        Unit color of each value, shape (k, 3); those of one component are orthogonal.
    deviations
        Standard deviation over the training materials that one unit of each value stands for,
        shape (k,).
    metadata
        JSON-able facts about the training.
    """

    resolution: Resolution
    mask: Mask
    centre: Floats
    components: Floats
    uses: npt.NDArray[np.int64]
    colours: Floats
    deviations: Floats
    metadata: dict[str, Any] = field(default_factory=dict)

    def __len__(self) -> int:
        """Number of values in a code."""
        return len(self.uses)

    @property
    def nbytes(self) -> int:
        """Memory of the basis, which all materials share."""
        arrays = self.centre, self.components, self.colours, self.deviations
        return sum(a.nbytes for a in arrays) + 8 * len(self) + math.ceil(self.mask.size / 8)

    def logarithms(self, code: Floats, nodes: Any = slice(None)) -> Floats:
        """ln(f w + e) of a code, shape (nodes, 3), at all nodes that take part or some of them."""
        colours = (np.asarray(code) * self.deviations)[:, None] * self.colours
        shares = np.zeros((len(self.components), 3))
        np.add.at(shares, self.uses, colours)
        components = self.components[:, nodes]
        return self.centre[nodes, None] + components.T @ shares.astype(components.dtype)

    def project(self, brdf: Brdf) -> npt.NDArray[np.float64]:
        """The code of a reflectance: least squares over the nodes at which it is known.

        Parameters
        ----------
        brdf
            Isotropic; a table on the same grid is taken as it is, anything else tabulated.

        Returns
        -------
        array of shape (k,)
            In standard deviations of the training materials, float64.

        Raises
        ------
        FormatError
            If `brdf` is anisotropic.
        NacreError
            If it is known at none of the nodes, or too unlike the training materials.
        """
        values, known = self.values(brdf)
        logs = encoded(values, self.weights())
        part = self.components[:, known]
        gram = (part @ part.T).astype(np.float64)[np.ix_(self.uses, self.uses)]
        normal = gram * (self.colours @ self.colours.T)
        sums = (part @ (logs - self.centre[:, None])[known]).astype(np.float64)
        right = np.einsum("kc,kc->k", sums[self.uses], self.colours)
        code = np.linalg.solve(normal + _RIDGE * np.eye(len(self)), right)
        code = np.asarray(code / self.deviations, np.float64)
        if not (np.abs(code) < 0.5 * LARGEST).all():  # half: it may grow when it is optimized
            name = brdf.name or "reflectance"
            raise NacreError(f"{name}: is too unlike the materials of the basis; train on more")
        return code

    def values(self, brdf: Brdf) -> tuple[Floats, Mask]:
        """f_r in 1/sr at the nodes that take part, shape (nodes, 3), and where it is known.

        Raises
        ------
        FormatError
            If `brdf` is anisotropic.
        NacreError
            If it is known at none of the nodes.
        """
        table = on_grid(brdf, self.resolution)
        known = table.mask[self.mask]
        if not known.any():
            raise NacreError(f"{brdf.name or 'reflectance'}: is known at no node of the basis")
        return reflectance(table)[self.mask], known

    def weights(self) -> Floats:
        """Weights w at the nodes that take part, shape (nodes,)."""
        return node_weights(self.resolution)[self.mask]

    def decode(self, code: npt.ArrayLike, name: str = "") -> PcaBrdf:
        """The reflectance that a code stands for.

        Parameters
        ----------
        code
            Shape (k,), in standard deviations. Whatever the values, f_r stays finite.
        name
            Of the material.

        Raises
        ------
        ValueError
            If the code has another length, or a value is a million or more.
        """
        return PcaBrdf(self, code, name)


class PcaBrdf(MerlBrdf):
    """A code and what it stands for, tabulated on the grid of its basis.

    Parameters
    ----------
    basis
        What the code belongs to.
    code
        Shape (k,); kept as float32.
    name
        Of the material.

    Raises
    ------
    ValueError
        If the code has another length, or a value is a million or more.
    """

    def __init__(self, basis: Basis, code: npt.ArrayLike, name: str = "") -> None:
        self.basis, self.code = basis, checked_code(code, len(basis))
        logs = np.minimum(basis.logarithms(self.code), _BRIGHTEST)
        f_r = np.maximum(np.exp(logs) - EPSILON, 0.0) / basis.weights()[:, None]
        stored = np.full((*basis.mask.shape, 3), INVALID, np.float32)
        stored[basis.mask] = f_r / np.asarray(SCALES)
        super().__init__(np.moveaxis(stored, -1, 0), name)

    @property
    def nbytes(self) -> int:
        """Bytes of the code: all materials share the basis."""
        return 4 * len(self.code)

    def describe(self) -> dict[str, Any]:
        """See :class:`nacre.brdf.Brdf`."""
        return super().describe() | code_facts(self.code, self.basis.nbytes)


def on_grid(brdf: Brdf, resolution: Resolution) -> MerlBrdf:
    """A reflectance on a grid: a table that is on it already as it is, anything else tabulated.

    Raises
    ------
    FormatError
        If `brdf` is anisotropic.
    """
    if isinstance(brdf, MerlBrdf) and brdf.dimensions == resolution.dimensions:
        return brdf
    return tabulate(brdf, resolution)


def reflectance(table: MerlBrdf) -> Floats:
    """f_r in 1/sr at every node, shape (theta_h, theta_d, phi_d, 3); negative where not valid."""
    return np.moveaxis(table.stored, 0, -1) * np.asarray(SCALES, np.float32)


def node_cosines(resolution: Resolution) -> tuple[Floats, Floats]:
    """Cosines of light and view at the nodes of a grid, float32."""
    light, view = (np.empty(resolution.dimensions, np.float32) for _ in range(2))
    for i in range(resolution.theta_h):
        wi, wo = node_directions(resolution, slice(i, i + 1))
        light[i], view[i] = wi[2][0], wo[2][0]
    return light, view


def node_weights(resolution: Resolution) -> Floats:
    """Weights w = max(cos theta_i cos theta_o, e) at the nodes of a grid, float32."""
    light, view = node_cosines(resolution)
    return np.maximum(light * view, np.float32(EPSILON))


def encoded(f_r: Floats, weights: Floats) -> Floats:
    """ln(f w + e) for f_r of shape (n, 3) and w of shape (n,); what is negative counts as 0."""
    logs: Floats = np.log(np.maximum(f_r, 0.0) * weights[:, None] + np.float32(EPSILON))
    return logs
