"""A latent basis: how much of a few fixed lobes a material has, in one color for all materials.

Three values cannot say much, but the class has what every basis needs. Its entry point, in
`pyproject.toml`:

    [project.entry-points."nacre.bases"]
    lobes = "nacre_example.basis:LobeBasis"
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import nnls

from nacre.array import Array, Components, Floats, namespace
from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.geometry import half_vector, split
from nacre.io.tensors import Tensors, check_numbers
from nacre.latent import CodedBrdf, LatentBasis
from nacre.latent.directions import isotropic_values, sampled, shared_directions
from nacre.runtime.progress import Progress, silent

DARKEST, BRIGHTEST = -12.0, 6.0
"""Bounds of a value: any code stands for a reflectance that is finite."""


@dataclass(frozen=True)
class LobeRecipe:
    """How the basis is made.

    Parameters
    ----------
    code_dim
        Number of values in a code: of lobes, from a diffuse one to a sharp one.
    directions
        Pairs of directions at which materials are compared.
    seed
        Random seed of these.
    """

    code_dim: int = 3
    directions: int = 4096
    seed: int = 0


class LobeBasis(LatentBasis):
    """Reflectance as a sum of powers of the half vector's cosine, weighted by exp(code).

    Parameters
    ----------
    exponents
        Powers of the lobes, shape (k,).
    color
        Of all lobes, shape (3,).
    metadata
        How these were found.
    """

    kind = "lobes"
    Recipe = LobeRecipe

    def __init__(
        self, exponents: Floats, color: Floats, metadata: dict[str, Any] | None = None
    ) -> None:
        self.exponents = np.asarray(exponents, np.float32)
        self.color = np.asarray(color, np.float32)
        self.metadata = dict(metadata or {})
        if self.exponents.ndim != 1 or self.color.shape != (3,):
            raise ValueError(f"exponents {self.exponents.shape} and color {self.color.shape}")

    @property
    def code_dim(self) -> int:
        """Number of values in a code."""
        return len(self.exponents)

    @property
    def nbytes(self) -> int:
        """Memory of the basis."""
        return self.exponents.nbytes + self.color.nbytes

    def lobes(self, wi: Components, wo: Components) -> list[Array]:
        """The lobes at directions, one array each, of any array library."""
        xp = namespace(*wi, *wo)
        cosine = xp.log(xp.maximum(half_vector(wi, wo)[2], 1e-6))
        return [xp.exp(float(exponent) * cosine) for exponent in self.exponents]

    def encode(self, source: Any, *, refine: bool = True, seed: int = 0) -> npt.NDArray[np.float64]:
        """The code whose weights of the lobes are nearest in the least-squares sense."""
        if not isinstance(source, Brdf):
            raise NacreError("the basis 'lobes' finds no code from samples alone")
        if not refine:
            raise NacreError("the basis 'lobes' has no projection and no encoder")
        wi, wo = shared_directions(LobeRecipe.directions, seed)
        f_r = isotropic_values(source, wi, wo) @ self.color / np.square(self.color).sum()
        known = f_r >= 0.0
        seen = (wi[:, 2] * wo[:, 2])[known].astype(np.float64)  # grazing angles count less
        rows = np.stack(self.lobes(split(wi), split(wo)), axis=1)[known]
        weights = nnls(seen[:, None] * rows, seen * f_r[known])[0]
        return np.clip(np.log(np.maximum(weights, 1e-30)), DARKEST, BRIGHTEST)

    def decode(self, code: npt.ArrayLike, name: str = "") -> LobeBrdf:
        """The reflectance that a code stands for."""
        return LobeBrdf(self, code, name)

    def pack(self) -> tuple[dict[str, Any], Tensors]:
        """Fields of a file's header, and tensors."""
        return {}, {"exponents": self.exponents, "color": self.color}

    @classmethod
    def unpack(cls, header: Mapping[str, Any], tensors: Tensors) -> LobeBasis:
        """The inverse of :meth:`pack`."""
        check_numbers(tensors, 1e6)
        return cls(tensors["exponents"], tensors["color"], header["metadata"])

    @classmethod
    def train(
        cls,
        materials: Sequence[Callable[[], Brdf]],
        recipe: LobeRecipe | None = None,
        *,
        base: Any = None,
        checkpoint: Any = None,
        progress: Progress | None = None,
    ) -> LobeBasis:
        """The basis in the mean color of some materials."""
        recipe = recipe or LobeRecipe()
        wi, wo = shared_directions(recipe.directions, recipe.seed)
        values, names = sampled(materials, wi, wo, progress or silent)
        color = np.mean([rows[rows[:, 0] >= 0.0].mean(axis=0) for rows in values], axis=0)
        exponents = [0.0, *np.geomspace(10.0, 1000.0, recipe.code_dim - 1)]
        metadata = {"materials": names, "training": asdict(recipe)}
        return cls(np.array(exponents), color / color.mean(), metadata)


class LobeBrdf(CodedBrdf):
    """A code and the reflectance that it stands for."""

    isotropy_known = True

    def __init__(self, basis: LobeBasis, code: npt.ArrayLike, name: str = "") -> None:
        super().__init__(name=name)
        self.basis, self.code = basis, basis.checked(code)
        self._weights = np.exp(np.clip(self.code, DARKEST, BRIGHTEST)).tolist()
        self._lobes, self._color = basis.lobes, basis.color.tolist()

    @property
    def nbytes(self) -> int:
        """Bytes of the code."""
        return self.code.nbytes

    def eval_components(self, wi: Components, wo: Components) -> Components:
        """The weighted sum of the lobes, in the color of the basis."""
        pairs = zip(self._weights, self._lobes(wi, wo), strict=True)
        total = sum(weight * lobe for weight, lobe in pairs)
        red, green, blue = (channel * total for channel in self._color)
        return red, green, blue
