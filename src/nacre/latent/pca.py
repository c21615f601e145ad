"""Principal components of log-relative reflectance.

Nielsen, Jensen and Ramamoorthi 2015, "On Optimal, Minimal BRDF Sampling for Reflectance
Acquisition". A reflectance f on the grid of the MERL database is seen as

    ln((f w + e) / (m w + e)),    w = max(cos theta_i cos theta_o, e),    e = 0.001,

where m w is the median of f w over the training materials. Their mean is subtracted, and the
principal components of the rest describe it. The median drops out of that difference: a basis keeps
its logarithm and the mean in one, which is the mean of ln(f w + e).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import astuple, dataclass, field, fields
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from nacre.array import Doubles, Floats, Mask
from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.io.tensors import Tensors, check_numbers
from nacre.latent.basis import LARGEST, CodedBrdf, LatentBasis, integers
from nacre.latent.recipes import GAIN, PcaRecipe
from nacre.measured.merl import INVALID, Resolution, node_directions, tabulate
from nacre.measured.merl_table import SCALES, MerlBrdf
from nacre.numerics.levenberg_marquardt import minimize

EPSILON = 1e-3  # added before logarithms, and the minimum weight of a node (Nielsen et al. 2015)

_BRIGHTEST = math.log(1e6)  # bound of ln(f w + e): whatever a code holds, the result is finite
_RIDGE = 1e-9  # pull of the code to zero, relative to the weight of all nodes
_NODES = 10_000  # nodes that a code is refined at: it has a few dozen values
_STEPS = 50
_TENSORS = ("mask", "centre", "components", "uses", "colours", "deviations")  # of a file


@dataclass(frozen=True, eq=False, repr=False)
class PcaBasis(LatentBasis):
    """Principal components over the nodes of a grid at which every training material is known.

    A material is a code of k values. ln(f w + e) at a node is the center plus, for each value, the
    product of the value, its standard deviation, a component and a color. Components belong to one
    channel, so they are shared: see :mod:`nacre.latent.pca_training`.
    """

    kind: ClassVar[str] = "pca"
    Recipe: ClassVar[type] = PcaRecipe
    trainer: ClassVar[str] = "nacre.latent.pca_training:train_components"
    projects: ClassVar[bool] = True
    linear_in_log: ClassVar[bool] = True

    resolution: Resolution
    mask: Mask  # nodes that take part, shape (theta_h, theta_d, phi_d)
    center: Floats  # mean of ln(f w + e) over materials and channels, shape (nodes,), float32
    components: Floats
    """Shape (components, nodes), float32; their products with the colors are orthonormal."""
    uses: npt.NDArray[np.int64]  # which component a value of the code is for, shape (k,)
    colors: Floats  # unit color of each value, shape (k, 3); those of one component are orthogonal
    deviations: Floats  # standard deviation that one unit of each value stands for, shape (k,)
    metadata: dict[str, Any] = field(default_factory=dict)

    @property
    def code_dim(self) -> int:
        return len(self.uses)

    @property
    def nbytes(self) -> int:
        arrays = self.center, self.components, self.colors, self.deviations
        return sum(a.nbytes for a in arrays) + 8 * self.code_dim + math.ceil(self.mask.size / 8)

    def logarithms(self, code: Floats, nodes: Any = slice(None)) -> Floats:
        """ln(f w + e) of a code, shape (nodes, 3), at all nodes that take part or some of them."""
        colors = (np.asarray(code) * self.deviations)[:, None] * self.colors
        weights = np.zeros((len(self.components), 3))
        np.add.at(weights, self.uses, colors)
        components = self.components[:, nodes]
        return self.center[nodes, None] + components.T @ weights.astype(components.dtype)

    def _projected(self, brdf: Brdf) -> Doubles:
        """Least squares of logarithms over the nodes at which a reflectance is known."""
        values, known = self.values(brdf)
        logs = encoded(values, self.weights())
        part = self.components[:, known]
        gram = (part @ part.T).astype(np.float64)[np.ix_(self.uses, self.uses)]
        normal = gram * (self.colors @ self.colors.T)
        sums = (part @ (logs - self.center[:, None])[known]).astype(np.float64)
        right = np.einsum("kc,kc->k", sums[self.uses], self.colors)
        code = np.linalg.solve(normal + _RIDGE * np.eye(self.code_dim), right)
        code = np.asarray(code / self.deviations, np.float64)
        if not (np.abs(code) < 0.5 * LARGEST).all():  # half: it may grow when it is refined
            name = brdf.name or "reflectance"
            raise NacreError(f"{name}: is too unlike the materials of the basis; train on more")
        return code

    def _refined(self, brdf: Brdf, seed: int) -> Doubles:
        """The code that comes closest in log(1 + k f cos theta_i), k being :data:`GAIN`.

        The projection is closest in the logarithm of f w, which counts what is dark as much as what
        is bright. From there the mean absolute difference of log(1 + k f cos theta_i) is minimized
        over nodes drawn uniformly in the Rusinkiewicz angles.
        """
        start = self._projected(brdf)
        values, known = self.values(brdf)
        # Rows of nodes lie at squares of equal steps: the angle that one stands for grows.
        row = np.nonzero(self.mask)[0]
        chance = known * (row + 0.5)
        drawn = np.random.default_rng(seed).choice(len(row), _NODES, p=chance / chance.sum())
        cosine = node_cosines(self.resolution)[0][self.mask][drawn]
        weights = self.weights()[drawn]
        target = np.log1p(GAIN * values[drawn] * cosine[:, None])
        slope = GAIN * cosine / weights
        directions = self.components[:, drawn].T[:, self.uses] * self.deviations
        colors = self.colors.T.astype(np.float64)

        def scaled(code: Doubles) -> Doubles:
            """The product k (f w + e) cos theta_i / w, shape (drawn, 3)."""
            decoded: Doubles = np.exp(self.logarithms(code, drawn).astype(np.float64))
            return decoded * slope[:, None]

        def residuals(code: Doubles) -> Doubles:
            above = np.maximum(scaled(code) - EPSILON * slope[:, None], 0.0)
            return np.log1p(above) - target

        def jacobian(code: Doubles, _: Doubles) -> Doubles:
            decoded = scaled(code)
            rate = decoded / (1.0 + np.maximum(decoded - EPSILON * slope[:, None], 0.0))
            rows = np.einsum("nk,nc,ck->knc", directions, rate, colors, optimize=True)
            return np.asarray(rows)

        with np.errstate(over="ignore", invalid="ignore"):
            return minimize(residuals, jacobian, start, _STEPS)[0]

    def values(self, brdf: Brdf) -> tuple[Floats, Mask]:
        """f_r in 1/sr at the nodes that take part, shape (nodes, 3), and where it is known.

        Raises FormatError if `brdf` is anisotropic, NacreError if it is known at none of the nodes.
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
        return PcaBrdf(self, code, name)

    def pack(self) -> tuple[dict[str, Any], Tensors]:
        arrays = self.center, self.components, self.colors, self.deviations
        names = "centre", "components", "colours", "deviations"
        tensors: Tensors = {
            "mask": np.packbits(self.mask),
            "uses": self.uses.astype(np.int32),
            **{n: np.ascontiguousarray(a, np.float32) for n, a in zip(names, arrays, strict=True)},
        }
        return {"resolution": list(astuple(self.resolution))}, tensors

    @classmethod
    def unpack(cls, header: Mapping[str, Any], tensors: Tensors) -> PcaBasis:
        sizes = integers(header, "resolution")
        if len(sizes) != len(fields(Resolution)):
            raise ValueError(f"resolution has {len(sizes)} numbers, expected 3")
        resolution = Resolution(*sizes)
        packed, center, components, uses, colors, deviations = (tensors[n] for n in _TENSORS)
        count = math.prod(resolution.dimensions)
        if packed.dtype != np.uint8 or packed.shape != (-(-count // 8),):
            raise ValueError(f"mask has another length than its {count} nodes need")
        mask = np.unpackbits(packed, count=count).astype(bool).reshape(resolution.dimensions)
        nodes, values = np.count_nonzero(mask), len(uses)
        if nodes < count // 8:
            raise ValueError(f"mask leaves {nodes} of {count} nodes")
        shapes = {
            "centre": (center, (nodes,)),
            "components": (components, (len(components), nodes)),
            "colours": (colors, (values, 3)),
            "deviations": (deviations, (values,)),
        }
        for name, (array, shape) in shapes.items():
            if array.dtype != np.float32 or array.shape != shape:
                raise ValueError(f"{name} is {array.dtype} {array.shape}, expected float32 {shape}")
            check_numbers({name: array}, LARGEST)
        known = (uses >= 0) & (uses < len(components))
        if uses.dtype != np.int32 or not known.all() or not values:
            raise ValueError("uses does not name components")
        if not (deviations > 0).all():
            raise ValueError("deviations are not positive")
        metadata = header["metadata"]
        index = uses.astype(np.int64)
        return cls(resolution, mask, center, components, index, colors, deviations, metadata)


class PcaBrdf(CodedBrdf, MerlBrdf):
    """A code and what it stands for, tabulated on the grid of its basis; see :class:`CodedBrdf`."""

    def __init__(self, basis: PcaBasis, code: npt.ArrayLike, name: str = "") -> None:
        self.basis, self.code = basis, basis.checked(code)
        logs = np.minimum(basis.logarithms(self.code), _BRIGHTEST)
        f_r = np.maximum(np.exp(logs) - EPSILON, 0.0) / basis.weights()[:, None]
        stored = np.full((*basis.mask.shape, 3), INVALID, np.float32)
        stored[basis.mask] = f_r / np.asarray(SCALES)
        super().__init__(np.moveaxis(stored, -1, 0), name)

    @property
    def nbytes(self) -> int:
        """Bytes of the code: all materials share the basis."""
        return self.code.nbytes


def on_grid(brdf: Brdf, resolution: Resolution) -> MerlBrdf:
    """A reflectance on a grid: a table that is on it already as it is, anything else tabulated.

    Raises FormatError if it is anisotropic.
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
    return np.asarray(np.log(np.maximum(f_r, 0.0) * weights[:, None] + np.float32(EPSILON)))
