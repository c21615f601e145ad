"""Pairs of directions that an instrument can measure."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.errors import NacreError
from nacre.geometry import from_spherical, join, split, to_spherical
from nacre.latent.directions import isotropic_inputs
from nacre.neural.inputs import ENHANCED

LIGHTS = 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 67.5, 75.0, 80.0
"""Polar angles of the light in degrees, in addition to half the smallest angle to the detector."""
HALFWAY = (0.0, 0.5, 1.0, 2.0, 3.0, 4.5, 6.5, 9.0, 12.0, 16.0, 21.0, 27.0, 34.0, 42.0, 52.0, 65.0)
"""Polar angles of the half vector in degrees, dense in highlights."""
AZIMUTHS = 9
"""Azimuths of the half vector from that of the light to the opposite one."""

_ACROSS = 3  # pairs along each edge that represent a picture
_SAME = 4  # pairs are the same if network inputs agree to this many decimals


@dataclass(frozen=True)
class Exposures:
    """Simultaneous measurements: pairs of unit directions, shapes (m, p, 3), float32.

    p is 1 for a detector; for a camera it is the number of pairs that represent a picture.
    """

    wi: npt.NDArray[np.float32]
    wo: npt.NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.wi)

    @property
    def pairs(self) -> int:
        return int(self.wi.shape[1])


@dataclass(frozen=True)
class Instrument:
    """The directions that an instrument reaches. Angles are in degrees.

    Parameters
    ----------
    max_polar
        Largest angle between the normal and the light, and the normal and the detector.
    min_angle
        Smallest angle between the light and the detector, before one blocks the other.
    fixed_light
        Polar angle of a light that cannot move, or None.
    in_plane
        Whether the detector stays in the plane of the light and the normal.
    step
        Angles of the axes are multiples of this.
    field
        Width and height of a camera's picture, as angles seen from the sample; None for a detector
        that measures one direction at a time.

    Raises
    ------
    ValueError
        If an angle is out of range.
    """

    max_polar: float = 80.0
    min_angle: float = 10.0
    fixed_light: float | None = None
    in_plane: bool = False
    step: float = 0.1
    field: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if not 0.0 < self.max_polar < 90.0:
            raise ValueError(f"the largest polar angle must be in 0 to 90, got {self.max_polar}")
        if not 0.0 <= self.min_angle < 2.0 * self.max_polar:
            raise ValueError(f"the smallest angle must be in 0 to 2 x max_polar: {self.min_angle}")
        if self.fixed_light is not None and not 0.0 <= self.fixed_light <= self.max_polar:
            raise ValueError(f"the light is at {self.fixed_light}, beyond the largest polar angle")
        if not 0.0 < self.step <= 15.0:
            raise ValueError(f"a step of the axes must be in 0 to 15, got {self.step}")
        if self.field and not all(0.0 < edge <= 60.0 for edge in self.field):
            raise ValueError(f"edges of a picture must be in 0 to 60, got {self.field}")

    def exposures(self) -> Exposures:
        """A coarse set of measurements for an isotropic material, with the light at azimuth 0.

        Raises NacreError if there are none.
        """
        lights = {0.5 * self.min_angle, *LIGHTS} if self.fixed_light is None else {self.fixed_light}
        azimuths = np.linspace(0.0, 180.0, 2 if self.in_plane else AZIMUTHS)
        grids = np.meshgrid(sorted(lights), HALFWAY, azimuths, indexing="ij")
        theta, halfway, azimuth = (np.radians(grid.reshape(-1)) for grid in grids)
        light = join(from_spherical(theta, 0.0 * theta))
        half = join(from_spherical(halfway, azimuth))
        view = 2.0 * (light * half).sum(axis=1, keepdims=True) * half - light
        above = view[:, 2] > 0.0
        light, view = self._rounded(light[above]), self._rounded(view[above])
        wi, wo = light[:, None], self._seen(view)
        kept = self._reached(wi, wo).all(axis=1)
        wi, wo = np.broadcast_to(wi, wo.shape)[kept], wo[kept]
        if not len(wi):
            raise NacreError("the instrument reaches no pair of directions; relax its limits")
        inputs = isotropic_inputs(wi.reshape(-1, 3), wo.reshape(-1, 3), ENHANCED)
        keys = inputs.round(_SAME).reshape(len(wi), -1)
        first = np.sort(np.unique(keys, axis=0, return_index=True)[1])
        return Exposures(wi[first].astype(np.float32), wo[first].astype(np.float32))

    def _rounded(self, w: npt.NDArray[np.floating]) -> npt.NDArray[np.float64]:
        """Directions (m, 3) whose angles are multiples of the step, towards the normal."""
        polar, azimuth = (np.degrees(angle) / self.step for angle in to_spherical(split(w)))
        whole = np.floor(polar + 0.5)
        most = math.floor(self.max_polar / self.step + 1e-6)
        whole = np.where((whole > most) & (polar < most + 0.5 + 1e-6), most, whole)
        angles = np.radians(np.stack([whole, np.round(azimuth)]) * self.step)
        return join(from_spherical(*angles)).astype(np.float64)

    def _reached(self, wi: Floats, wo: Floats) -> npt.NDArray[np.bool_]:
        """Whether the light and the detector reach directions (..., 3)."""
        lowest = math.cos(math.radians(self.max_polar)) - 1e-6
        between = (wi * wo).sum(axis=-1)
        apart = between <= math.cos(math.radians(self.min_angle)) + 1e-6
        return np.asarray((wi[..., 2] >= lowest) & (wo[..., 2] >= lowest) & apart)

    def _seen(self, view: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Directions (m, p, 3) that represent a picture around each of `view`, (m, 3)."""
        if self.field is None:
            return view[:, None]
        right = np.cross([0.0, 0.0, 1.0], view)
        straight = np.linalg.norm(right, axis=1, keepdims=True) < 1e-6
        right = np.where(straight, [0.0, 1.0, 0.0], right)
        right /= np.linalg.norm(right, axis=1, keepdims=True)
        up = np.cross(view, right)
        width, height = (math.tan(math.radians(0.5 * edge)) for edge in self.field)
        across = np.linspace(-1.0, 1.0, _ACROSS)
        x, y = (grid.reshape(-1, 1) for grid in np.meshgrid(width * across, height * across))
        seen = view[:, None] + x * right[:, None] + y * up[:, None]
        return np.asarray(seen / np.linalg.norm(seen, axis=-1, keepdims=True))
