"""Reflectances with a formula and a few named parameters."""

from __future__ import annotations

import abc
import math
import reprlib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Literal, TypeAlias

import numpy as np

from nacre.array import Array, Components, Table, namespace
from nacre.brdf import Sampler
from nacre.numerics.direction_samples import loss_scale
from nacre.sampling import LobeSampledBrdf

Value: TypeAlias = float | tuple[float, ...] | tuple[tuple[float, ...], ...]
"""A number, one per color channel, or a table: rows of numbers."""

Values: TypeAlias = Mapping[str, Any]
"""Parameters by name: arrays, tuples of three where there is one per color channel, and
:class:`nacre.array.Table`."""

CHANNELS = 3


def between(free: Array, low: Array, high: Array) -> Array:
    """Numbers between bounds for numbers on the whole line, by the logistic curve."""
    return low + (high - low) / (1.0 + namespace(free).exp(-free))


class _Bounded:
    low: float
    high: float

    def to_free(self, value: Array) -> Array:
        """A number on the whole line for a value between the bounds; inverse of `from_free`."""
        fraction = np.clip(
            (np.asarray(value) - self.low) / (self.high - self.low), 1e-13, 1 - 1e-13
        )
        return np.log(fraction) - np.log1p(-fraction)

    def from_free(self, free: Array) -> Array:
        """The logistic curve between the bounds: near either, steps are ratios of the distance."""
        return between(free, self.low, self.high)


@dataclass(frozen=True)
class Parameter(_Bounded):
    """A named parameter of a model, and its range."""

    name: str  # as in the model's files
    low: float  # bounds, both included
    high: float
    start: tuple[float, float]
    """Range that a fit starts from, at random: evenly in the logarithm, or evenly where it reaches
    down to 0 or below."""
    color: bool = False
    """Whether there is one per color channel. In a model that is fitted on samples, such a
    parameter acts on its own channel only."""
    allowed: tuple[float, float] | None = None
    """Range of what a material may have, where that is wider than what fits look for: colors of
    other color spaces, which may leave [0, 1] in Rec. 709. Formulas get `low` for less."""

    @property
    def shape(self) -> tuple[int, ...]:
        return (CHANNELS,) if self.color else ()

    @property
    def size(self) -> int:
        return CHANNELS if self.color else 1

    def at(self, fraction: Array) -> Array:
        """The point of :attr:`start` at a fraction of the way from end to end, in [0, 1]."""
        low, high = self.start
        if low <= 0.0:
            return low + (high - low) * fraction
        return low * (high / low) ** fraction

    def check(self, value: Any) -> Value:
        """`value` as one float or three.

        Raises ValueError if it is no number, of another shape, not finite or out of bounds.
        """
        given = np.array(value)
        if given.dtype.kind not in "iuf":
            raise ValueError(f"{self.name} takes numbers, got {reprlib.repr(value)}")
        numbers = given.astype(np.float64)
        if numbers.shape != self.shape:
            kind = "three numbers" if self.color else "one number"
            raise ValueError(f"{self.name} takes {kind}, got {reprlib.repr(value)}")
        low, high = self.allowed or (self.low, self.high)
        if not _within(numbers, low, high):
            raise ValueError(
                f"{self.name} must lie in [{low:g}, {high:g}], got {reprlib.repr(value)}"
            )
        return tuple(numbers.tolist()) if self.color else float(numbers)

    def operand(self, value: Any) -> Any:
        """What a formula takes for a value: nothing below :attr:`low`."""
        if self.allowed is None:
            return value
        return tuple(max(v, self.low) for v in value) if self.color else max(value, self.low)


@dataclass(frozen=True)
class TableParameter(_Bounded):
    """A function of one angle that a model has as numbers at nodes, in [`low`, `high`].

    It has one row, or three where each color channel has its own; its name is that in the model's
    files.
    """

    name: str
    rows: int
    nodes: int
    high: float
    low: float = 0.0

    @property
    def shape(self) -> tuple[int, ...]:
        return self.rows, self.nodes

    @property
    def size(self) -> int:
        return self.rows * self.nodes

    def check(self, value: Any) -> Value:
        """`value` as rows of numbers, each the shortest that stands for the same float32.

        Raises ValueError if it has another shape, is not finite or out of bounds.
        """
        numbers = np.array(value, np.float64)
        if numbers.shape != self.shape:
            raise ValueError(f"{self.name} takes {self.rows} rows of {self.nodes} numbers")
        if not _within(numbers, self.low, self.high):
            raise ValueError(f"{self.name} must lie in [0, {self.high:g}] throughout")
        single = numbers.astype(np.float32)
        return tuple(tuple(float(np.format_float_scientific(x)) for x in row) for row in single)


def _within(numbers: Array, low: float, high: float) -> bool:
    return bool((np.isfinite(numbers) & (numbers >= low) & (numbers <= high)).all())


class AnalyticBrdf(LobeSampledBrdf):
    """A reflectance with a formula and named parameters.

    A subclass has a :attr:`model`, :attr:`parameters` and a :meth:`formula`, and a sampler of its
    own if lobes fitted to it are not good enough. An object is made from `values`: every one of
    :attr:`parameters` and :attr:`tables` by name, a number, three for a color, rows of numbers for
    a table; ValueError if one is missing, unknown, or out of bounds. The `metadata` are JSON-able
    facts about the fit and its source, kept in the file.
    """

    model: ClassVar[str]
    """Name of the model, in files and on the command line."""

    parameters: ClassVar[tuple[Parameter, ...]]

    tables: ClassVar[tuple[TableParameter, ...]] = ()
    """What a model has as tables beside its parameters; it brings its own fit then."""

    fitted_on: ClassVar[Literal["samples", "pictures"]] = "samples"
    """What a fit compares: single directions, or views under lights as pictures show them."""

    def __init__(
        self,
        *,
        name: str = "",
        source: Mapping[str, str] | None = None,
        sampler: Sampler | None = None,
        metadata: Mapping[str, Any] | None = None,
        **values: Any,
    ) -> None:
        super().__init__(name=name, source=source, sampler=sampler)
        known = self.numbers()
        names = [parameter.name for parameter in known]
        if set(values) != set(names):
            unknown = [n for n in values if n not in names]
            wrong = {"lacks": [n for n in names if n not in values], "has no": unknown}
            parts = (f"{verb} {', '.join(part)[:200]}" for verb, part in wrong.items() if part)
            raise ValueError(f"{self.model} {' and '.join(parts)}")
        self.values: Mapping[str, Value] = {p.name: p.check(values[p.name]) for p in known}
        self.metadata: Mapping[str, Any] = dict(metadata or {})

    @staticmethod
    @abc.abstractmethod
    def formula(values: Values, wi: Components, wo: Components) -> Components:
        """f_r in 1/sr, on components of any array library.

        `values` are the parameters: numbers or arrays that broadcast against the directions. These
        may lie below the horizon, where the result is ignored.
        """

    def eval_components(self, wi: Components, wo: Components) -> Components:
        """See :class:`nacre.brdf.Brdf`; parameters enter a Dr.Jit kernel as literals."""
        return self.formula(self.operands, wi, wo)

    @cached_property
    def operands(self) -> Values:
        """What :meth:`formula` takes: the values, with tables as arrays to gather from."""
        found: dict[str, Any] = {p.name: p.operand(self.values[p.name]) for p in self.parameters}
        return found | {t.name: Table(self.values[t.name]) for t in self.tables}

    @property
    def nbytes(self) -> int:
        return 4 * sum(parameter.size for parameter in self.numbers())

    @classmethod
    def numbers(cls) -> tuple[Parameter | TableParameter, ...]:
        """All that a material of this model is made of."""
        return (*cls.parameters, *cls.tables)

    def summary(self) -> str:
        """The model and its parameters in one line, rounded."""
        return ", ".join([self.model, *(f"{k} {v}" for k, v in self._shown().items())])

    def loss_text(self) -> str:
        """The loss of a fit with its scale, "loss 0.00312 (log(1 + f cos))"; else empty."""
        fit = self.metadata.get("fit", {})
        if not isinstance(fit.get("loss"), float):
            return ""
        return f"loss {fit['loss']:.5f} ({loss_scale(fit.get('gain'))})"

    def _shown(self) -> dict[str, str]:
        tables = {table.name: f"{table.rows} x {table.nodes}" for table in self.tables}
        return {k: tables.get(k) or _rounded(v) for k, v in self.values.items()}

    def describe(self) -> dict[str, Any]:
        values = self._shown()
        source = self.metadata.get("source", {})
        facts = {
            "fitted to": source.get("file"),
            "fitted to sha256": source.get("sha256"),
            "terms of the source": source.get("terms"),
            **{f"fit {key}": value for key, value in self.metadata.get("fit", {}).items()},
        }
        return super().describe() | values | {k: v for k, v in facts.items() if v is not None}


def _rounded(value: Value) -> str:
    if isinstance(value, tuple):
        return f"({', '.join(f'{v:.4g}' for v in value)})"
    return f"{value:.4g}"


DIFFUSE = Parameter("diffuse", 0.0, 10.0, (0.01, 0.5), color=True)
"""Albedo of the Lambertian part that most models have."""


def lambertian(values: Values) -> Components:
    red, green, blue = (albedo / math.pi for albedo in values[DIFFUSE.name])
    return red, green, blue


SCALE = Parameter("specular", 0.0, 1e3, (0.01, 1.0), color=True)
"""Color that scales the lobe of models whose Fresnel term has none."""

NORMAL_REFLECTANCE = Parameter("normal_reflectance", 0.0, 1.0, (0.05, 0.9))
"""F0 of Schlick's Fresnel term."""

INDEX = Parameter("index", 1.0, 1e3, (1.2, 3.0))  # refractive index of a dielectric's Fresnel term


def coated(values: Values, lobe: Array) -> Components:
    """The Lambertian part and a lobe that `specular` colors."""
    base = lambertian(values)
    red, green, blue = (d + s * lobe for d, s in zip(base, values["specular"], strict=True))
    return red, green, blue
