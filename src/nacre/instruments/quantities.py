"""What instruments read, each as a function of sums of f_r that can be turned round.

A quantity sums f_r over its pairs of directions, in linear RGB. What it sees of the sum is linear:
the luminance, or all three channels. A reading shows that on a scale: gloss units, CIELAB.
"""

from __future__ import annotations

import abc
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from nacre.array import Doubles
from nacre.brdf import Brdf
from nacre.color import lab_to_xyz, rgb_to_xyz, xyz_to_lab
from nacre.instruments.apertures import frame, turned
from nacre.instruments.colors import Color
from nacre.instruments.forty_five import annular_pairs, directional_pairs
from nacre.instruments.glossmeter import ANGLES, flux_pairs, receptor, reference, white_flux
from nacre.instruments.goniocolorimeter import Geometry
from nacre.instruments.hazemeter import ANGLE, bands, log_haze
from nacre.instruments.illuminants import Illuminant, Observer, rgb_weights
from nacre.instruments.integrating_sphere import beam_pairs, included_pairs, trapped_pairs
from nacre.instruments.observing import Specimen
from nacre.instruments.pairs import Pairs
from nacre.instruments.quadrature import EXACT, Rule

_LUMINANCE = rgb_to_xyz(np.eye(3))[:, 1]


@dataclass(frozen=True)
class Quantity(abc.ABC):
    """A value, or a color, that an instrument reads."""

    instrument: ClassVar[str]
    """As `nacre measure` calls it."""
    unit: ClassVar[str] = ""
    components: ClassVar[tuple[str, ...]] = ("value",)
    """Names of the values of a reading."""

    @property
    @abc.abstractmethod
    def geometry(self) -> str:
        """Angles, or what else tells it from others of the instrument."""

    @property
    def name(self) -> str:
        return f"{self.instrument} {self.geometry}".strip()

    @abc.abstractmethod
    def pairs(self, rule: Rule = EXACT) -> Pairs:
        """The pairs of directions, as dense as a rule says."""

    def seen(self, sums: npt.ArrayLike) -> Doubles:
        """What is seen of sums in linear RGB, (..., 3): the luminance, (..., 1)."""
        return (np.asarray(sums, np.float64) @ _LUMINANCE)[..., None]

    def shown(self, seen: npt.ArrayLike) -> Doubles:
        """Values on the scale of the instrument, (..., v), from what is seen, (..., c)."""
        return np.asarray(seen, np.float64)

    def turned_back(self, values: npt.ArrayLike) -> Doubles:
        """What is seen, (..., c), from values on the scale of the instrument, (..., v)."""
        return np.asarray(values, np.float64)

    @abc.abstractmethod
    def uncertainty(self, values: Sequence[float]) -> float:
        """Standard deviation of each of the values, where a reading states none."""

    def read(self, brdf: Brdf, azimuth: float = 0.0) -> tuple[float, ...]:
        """What the instrument reads of a material, with the light at an azimuth in degrees.

        Raises NacreError if the bands of the material make no color.
        """
        specimen = Specimen(brdf, azimuth, color=len(self.components) > 1)
        luminous = specimen.luminous(specimen.sum(self.pairs()))
        return tuple(self.shown([luminous]).tolist())


@dataclass(frozen=True)
class GlossQuantity(Quantity):
    """Specular gloss at 20, 60 or 85 degrees."""

    instrument = "gloss"
    unit = "GU"

    angle: float

    def __post_init__(self) -> None:
        if self.angle not in ANGLES:
            raise ValueError(f"gloss is measured at 20, 60 or 85 degrees, not {self.angle:g}")

    @property
    def geometry(self) -> str:
        return f"{self.angle:g}"

    def pairs(self, rule: Rule = EXACT) -> Pairs:
        pairs = flux_pairs(self.angle, [receptor(self.angle)], rule)
        return pairs.scaled(100.0 / reference(self.angle))

    def uncertainty(self, values: Sequence[float]) -> float:
        return max(0.5, 0.005 * values[0])


@dataclass(frozen=True)
class HazeQuantity(Quantity):
    """Reflection haze at 20 degrees: "linear", "log", or linear and "compensated" for diffuse light
    (:class:`nacre.instruments.Haze`).
    """

    instrument = "haze"
    unit = "HU"

    scale: str = "linear"

    @property
    def geometry(self) -> str:
        return "" if self.scale == "linear" else self.scale

    def pairs(self, rule: Rule = EXACT) -> Pairs:
        pairs = flux_pairs(ANGLE, bands(), rule).scaled(100.0 / reference(ANGLE))
        if self.scale != "compensated":
            return pairs
        white = 100.0 / reference(ANGLE) * white_flux(ANGLE, bands())
        return Pairs.joined([pairs, annular_pairs().scaled(-white)])

    def shown(self, seen: npt.ArrayLike) -> Doubles:
        values = np.maximum(seen, 0.0)
        return np.vectorize(log_haze)(values) if self.scale == "log" else values

    def turned_back(self, values: npt.ArrayLike) -> Doubles:
        found = np.asarray(values, np.float64)
        return 20.0 * (10.0 ** (found / 1285.0) - 1.0) if self.scale == "log" else found

    def uncertainty(self, values: Sequence[float]) -> float:
        return 10.0 if self.scale == "log" else max(0.5, 0.01 * values[0])


@dataclass(frozen=True)
class ColorQuantity(Quantity):
    """A color in CIELAB."""

    components = ("L*", "a*", "b*")
    deviation: ClassVar[float] = 0.2
    """Standard deviation of each value, where a reading states none."""

    illuminant: Illuminant = field(default="D65", kw_only=True)
    observer: Observer = field(default=2, kw_only=True)

    def seen(self, sums: npt.ArrayLike) -> Doubles:
        return np.asarray(sums, np.float64)

    def shown(self, seen: npt.ArrayLike) -> Doubles:
        weights = rgb_weights(self.illuminant, self.observer)
        return xyz_to_lab(np.asarray(seen) @ weights, weights.sum(axis=0))

    def turned_back(self, values: npt.ArrayLike) -> Doubles:
        return self.from_xyz(lab_to_xyz(values) * self.white)

    @property
    def white(self) -> Doubles:
        """Tristimulus values of the perfect white, (3,)."""
        return np.asarray(rgb_weights(self.illuminant, self.observer).sum(axis=0))

    def from_xyz(self, xyz: npt.ArrayLike) -> Doubles:
        """Linear RGB of tristimulus values, (..., 3)."""
        return np.asarray(
            np.asarray(xyz, np.float64) @ np.linalg.inv(rgb_weights(self.illuminant, self.observer))
        )

    def uncertainty(self, values: Sequence[float]) -> float:
        return self.deviation

    def read(self, brdf: Brdf, azimuth: float = 0.0) -> tuple[float, ...]:
        return self.color(brdf, azimuth).lab

    def color(self, brdf: Brdf, azimuth: float = 0.0) -> Color:
        """The color of a material; see :meth:`read`."""
        specimen = Specimen(brdf, azimuth)
        return specimen.color(specimen.sum(self.pairs()), self.illuminant, self.observer)


@dataclass(frozen=True)
class MultiangleQuantity(ColorQuantity):
    """The color at one angle of a multi-angle instrument."""

    instrument = "multiangle"
    deviation = 0.3

    at: Geometry

    @property
    def geometry(self) -> str:
        return self.at.name

    def pairs(self, rule: Rule = EXACT) -> Pairs:
        return self.at.pairs()


@dataclass(frozen=True)
class SphereQuantity(ColorQuantity):
    """The color in an integrating sphere: "di:8", "de:8", or "N:di" for light at N degrees."""

    instrument = "sphere"

    at: str

    @property
    def geometry(self) -> str:
        return self.at

    def pairs(self, rule: Rule = EXACT) -> Pairs:
        if self.at.endswith(":di"):
            return beam_pairs(float(self.at.removesuffix(":di")), rule)
        if self.at == "di:8":
            return included_pairs(rule)
        return Pairs.joined([included_pairs(rule), trapped_pairs(rule).scaled(-1.0)])


@dataclass(frozen=True)
class FortyFiveQuantity(ColorQuantity):
    """The color at "45a:0" or "45x:0"."""

    instrument = "45-0"

    at: str

    @property
    def geometry(self) -> str:
        return self.at

    def pairs(self, rule: Rule = EXACT) -> Pairs:
        return annular_pairs() if self.at == "45a:0" else directional_pairs()


@dataclass(frozen=True)
class Luminance(Quantity):
    """Y of a color alone, where the perfect white has 100."""

    unit = "Y"

    color: ColorQuantity

    @property
    def instrument(self) -> str:  # type: ignore[override]
        return self.color.instrument

    @property
    def geometry(self) -> str:
        return self.color.geometry

    def pairs(self, rule: Rule = EXACT) -> Pairs:
        return self.color.pairs(rule)

    def seen(self, sums: npt.ArrayLike) -> Doubles:
        weights = rgb_weights(self.color.illuminant, self.color.observer)[:, 1:2]
        return np.asarray(np.asarray(sums, np.float64) @ weights)

    def uncertainty(self, values: Sequence[float]) -> float:
        return max(0.1, 0.005 * values[0])

    def read(self, brdf: Brdf, azimuth: float = 0.0) -> tuple[float, ...]:
        return (self.color.color(brdf, azimuth).xyz[1],)


@dataclass(frozen=True)
class ReflectanceQuantity(Quantity):
    """f_r in 1/sr, linear RGB, at one pair of directions: angles in degrees."""

    instrument = "f_r"
    unit = "1/sr"
    components = ("r", "g", "b")

    theta_i: float
    phi_i: float
    theta_o: float
    phi_o: float

    def __post_init__(self) -> None:
        if not all(0.0 <= theta < 90.0 for theta in (self.theta_i, self.theta_o)):
            raise ValueError("theta must be from 0 to below 90 degrees")

    @property
    def geometry(self) -> str:
        return f"{self.theta_i:g} {self.phi_i:g} {self.theta_o:g} {self.phi_o:g}"

    def pairs(self, rule: Rule = EXACT) -> Pairs:
        angles = (self.theta_i, self.phi_i), (self.theta_o, self.phi_o)
        wi, wo = (_direction(*pair)[None] for pair in angles)
        return Pairs(wi, wo, np.ones(1))

    def seen(self, sums: npt.ArrayLike) -> Doubles:
        return np.asarray(sums, np.float64)

    def uncertainty(self, values: Sequence[float]) -> float:
        return 0.02 * max(values)

    def read(self, brdf: Brdf, azimuth: float = 0.0) -> tuple[float, ...]:
        pairs = self.pairs()
        r, g, b = brdf.eval(pairs.wi[0], pairs.wo[0]).tolist()
        return r, g, b


def _direction(theta: float, phi: float) -> Doubles:
    """A unit direction, (3,), from angles in degrees."""
    return np.asarray(turned(frame(theta)[2], phi))
