"""Fits a mixture of closures to pictures.

Between two nodes of the tables every number is linear in the facing ratio, so each point of a
picture depends on two nodes only, and the normal equations are small. They are those of
Levenberg-Marquardt; bounds are kept by holding the numbers that would leave them. The fit minimizes
the logarithms of the mean squared errors of three kinds of pictures in display values: views under
an even sky and lamps, spheres lit from the front, and spheres lit from behind. Steps between
neighboring nodes add a little, for where pictures do not decide.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from nacre.array import Floats, Mask
from nacre.brdf import Brdf
from nacre.color import displayed
from nacre.errors import NacreError
from nacre.geometry import half_vector, split
from nacre.runtime.progress import Progress
from nacre.sampling.energy import albedos
from nacre.sampling.lit_views import LAMPS, SHARPNESS, lit_spheres, lit_views
from nacre.standard.bent_closures import (
    HORIZON,
    LOBES,
    NODES,
    ROWS,
    TABLES,
    bent_facets,
    bent_normal,
    view_frame,
)

Vector = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]

_VIEWS, _ROUGH_VIEWS = (80, 512, 12), (32, 200, 6)  # views, directions and lights of each
_GRAZING = 1.3  # half of the views have a uniform number to this power as their facing ratio
_SIZE, _ROUGH_SIZE = 40, 20  # pixels along an edge of a sphere
_FRONT, _BACK = np.linspace(0.0, 75.0, 12), np.linspace(80.0, 174.0, 20)  # degrees, light and view
_WEIGHTS = 1.5, 2.5, 0.7  # of the kinds of pictures: views, front, back
_SMOOTH = 2e-3  # weight of a step between nodes
_DARK = 3e-4  # added to radiance, because the gamma curve is steepest in the dark
_FLOOR = 1e-6  # mean squared errors below this do not count
_BEND = -0.4  # lowest bend over the facing ratio: mirror directions stay above the horizon
_DIFFUSE_BEND = -0.9  # the same for the diffuse closure: its normal faces the viewer
_NARROW = 0.1  # smallest roughness: narrower lobes than the cells of tables sparkle
_STEP = 1e-4  # of differences
_STARTS = ((0.2, 0.4, 0.7), (0.1, 0.25, 0.5), (0.4, 0.6, 0.9), (0.1, 0.4, 0.8))
_FEW, _ALL = 40, 80  # steps of a start, and of the best of them

_DIFFUSE = 0  # column of the first channel
_COLORS = np.array([_DIFFUSE, *(ROWS.index((f"color{k}", 0)) for k in range(1, LOBES + 1))])
_BENDS = np.array([ROWS.index((f"bend{k}", 0)) for k in range(LOBES + 1)])
_SHAPES = [[ROWS.index((f"roughness{k}", row)) for row in range(2)] for k in range(1, LOBES + 1)]
_FREE = np.array([_BENDS[0], *(c for k in range(LOBES) for c in (*_SHAPES[k], _BENDS[k + 1]))])
_OWNERS = np.array([0, *(k for k in range(1, LOBES + 1) for _ in range(3))])
_IS_COLOR = np.array([name.startswith(("color", "diffuse")) for name, _ in ROWS])
_IS_BEND = np.array([name.startswith("bend") for name, _ in ROWS])


class _Basis(NamedTuple):
    """Reflectance of closures at pairs of directions; derivatives are by :data:`_FREE`."""

    values: Vector  # (closures, n), f_r of colors of 1
    derivatives: Vector  # (shapes, n)


class _Pairs:
    """Pairs of directions, and the place of their facing ratios between the nodes."""

    def __init__(self, wi: Floats, wo: Floats, known: Mask) -> None:
        pair = (split(w.reshape(-1, 3).astype(np.float64)) for w in (wi, wo))
        self.light, self.view = view_frame(*pair)
        self.half = half_vector(self.light, self.view)
        self.scale = known / np.maximum(self.light[2], HORIZON)
        nodes = np.asarray(NODES)
        cell = np.searchsorted(nodes, self.view[2], side="right") - 1
        self.cell: Indices = np.asarray(np.clip(cell, 0, len(nodes) - 2))
        part = (self.view[2] - nodes[self.cell]) / np.diff(nodes)[self.cell]
        self.part = np.clip(part, 0.0, 1.0)

    def local(self, table: Vector) -> Vector:
        """Rows of numbers at the pairs, (rows, n), from those at the nodes, (nodes, rows)."""
        low, high = table[self.cell], table[self.cell + 1]
        return np.asarray((low + self.part[:, None] * (high - low)).T)

    def basis(self, local: Vector, derivatives: bool) -> _Basis:
        values, steps = [self._diffuse(local[_BENDS[0]])], []
        if derivatives:
            steps.append(self._diffuse(local[_BENDS[0]] + _STEP) - values[0])
        for k in range(LOBES):
            shape = local[[*_SHAPES[k], _BENDS[k + 1]]]
            values.append(self._facets(*shape))
            for j in range(3 if derivatives else 0):
                moved = shape.copy()
                moved[j] += _STEP
                steps.append(self._facets(*moved) - values[-1])
        return _Basis(np.array(values), np.array(steps) / _STEP)

    def _diffuse(self, bend: Vector) -> Vector:
        x, z = bent_normal(bend, self.view)
        lit = np.maximum(x * self.light[0] + z * self.light[2], 0.0)
        return np.asarray(lit * self.scale / math.pi)

    def _facets(self, along: Vector, across: Vector, bend: Vector) -> Vector:
        normal, alpha = bent_normal(bend, self.view), (along**2, across**2)
        facets = bent_facets(normal, alpha, self.light, self.view, self.half)
        return np.asarray(facets * self.scale)


class _Equations:
    """Normal equations for the numbers at the nodes, as sums over the pictures."""

    def __init__(self) -> None:
        shape = len(NODES), len(ROWS)
        self.gradient, self.curvature = np.zeros(shape), np.zeros((*shape, *shape))

    def add(self, cell: Indices, part: Vector, rows: Vector, error: Vector, columns: Any) -> None:
        """Add residuals (n,) and their derivatives (n, columns) by the numbers at the view."""
        parts = np.concatenate([rows * (1.0 - part)[:, None], rows * part[:, None]], axis=1)
        count = len(columns)
        for k in np.unique(cell):
            here = cell == k
            own = parts[here]
            square, slope = own.T @ own, own.T @ error[here]
            for i in range(2):
                across = slice(i * count, (i + 1) * count)
                self.gradient[k + i, columns] += slope[across]
                for j in range(2):
                    down = slice(j * count, (j + 1) * count)
                    place = k + i, columns[:, None], k + j, columns
                    self.curvature[place] += square[across, down]


class _Pictures:
    """Pictures of a material, of one kind, that a mixture is compared with.

    With `weights`, of shape (v, lights, n), pairs are n directions to the light for each of v
    views; without, each pair is a picture, under directional light with irradiance pi.
    """

    def __init__(self, brdf: Brdf, wi: Floats, wo: Floats, weights: Floats | None = None) -> None:
        wi, wo = (w.reshape(-1, 3) for w in (wi, wo))
        known = brdf.valid(wi, wo)
        if known.mean() < 0.01:
            raise NacreError(f"{brdf.name or 'reflectance'}: hardly any of it is known")
        self._pairs = _Pairs(wi, wo, known)
        self._cosine = math.pi * wi[:, 2].astype(np.float64)
        self._weights = None if weights is None else weights.astype(np.float64)
        truth = np.where(known[:, None], np.maximum(brdf.eval(wi, wo), 0.0), 0.0)
        self._target = displayed(self._seen(truth.T.astype(np.float64)), _DARK)[0]
        cell, part = self._pairs.cell, self._pairs.part
        if weights is not None:
            _, lights, count = weights.shape
            cell, part = cell[::count].repeat(lights), part[::count].repeat(lights)
        self._cell, self._part = cell, part

    def _seen(self, f_r: Vector) -> Vector:
        """Radiance in the pictures, (pictures, k), from k reflectances at the pairs, (k, pairs)."""
        if self._weights is None:
            return np.asarray((f_r * self._cosine).T)
        views, _, count = self._weights.shape
        seen = self._weights @ f_r.reshape(-1, views, count).transpose(1, 2, 0)
        return np.asarray(seen.reshape(-1, len(f_r)))

    def error(self, table: Vector, equations: _Equations | None = None) -> float:
        """Mean squared error of a mixture; its equations are added to `equations`."""
        local = self._pairs.local(table)
        basis = self._pairs.basis(local, equations is not None)
        total = 0.0
        for channel in range(3):
            colors = local[_COLORS + channel]
            seen = self._seen((colors * basis.values).sum(0)[None])
            shown, slope = displayed(seen[:, 0], _DARK)
            error = shown - self._target[:, channel]
            total += float(error @ error)
            if equations is not None:
                by = np.concatenate([basis.derivatives * colors[_OWNERS], basis.values])
                rows = self._seen(by) * slope[:, None]
                columns = np.concatenate([_FREE, _COLORS + channel])
                equations.add(self._cell, self._part, rows, error, columns)
        if equations is not None:
            equations.gradient /= self._target.size
            equations.curvature /= self._target.size
        return total / self._target.size


class _Problem:
    """The error of mixtures as a function of the numbers at the nodes, shape (nodes, rows)."""

    def __init__(self, brdf: Brdf, seed: int, *, rough: bool = False) -> None:
        (count, directions, lights), size = (
            (_ROUGH_VIEWS, _ROUGH_SIZE) if rough else (_VIEWS, _SIZE)
        )
        even = (np.arange(count // 2) + 0.5) / (count // 2)
        facing = np.concatenate([np.sqrt(even), even**_GRAZING])
        sines = (1.0 - facing**2).tolist()
        lit = lit_views(seed, sines, directions, lights, SHARPNESS, LAMPS, brdf.isotropic)
        spheres = (lit_spheres(x.tolist(), size, brdf.isotropic) for x in (_FRONT, _BACK))
        self.kinds = [
            _Pictures(brdf, lit.wi, lit.wo, lit.weights),
            *(_Pictures(brdf, *pairs) for pairs in spheres),
        ]
        low, high = (
            np.tile([getattr(t, end) for t in TABLES for _ in range(t.rows)], (len(NODES), 1))
            for end in ("low", "high")
        )
        nodes = np.asarray(NODES)
        low[:, _BENDS[1:]], low[:, _BENDS[0]] = _BEND * nodes[:, None], _DIFFUSE_BEND * nodes
        low[:, np.ravel(_SHAPES)] = _NARROW
        self.low, self.high = low, high

    def value(self, table: Vector) -> float:
        """The value to minimize."""
        errors = (kind.error(table) for kind in self.kinds)
        logs = (w * math.log(e + _FLOOR) for w, e in zip(_WEIGHTS, errors, strict=True))
        return sum(logs) + _SMOOTH * float((np.diff(_even(table)[0], axis=0) ** 2).sum())

    def equations(self, table: Vector) -> tuple[Vector, Vector]:
        """Gradient and curvature of :meth:`value`, flat."""
        gradient, curvature = _smoothness(table)
        for weight, kind in zip(_WEIGHTS, self.kinds, strict=True):
            equations = _Equations()
            scale = 2.0 * weight / (kind.error(table, equations) + _FLOOR)
            gradient += scale * equations.gradient
            curvature += scale * equations.curvature
        size = gradient.size
        return gradient.reshape(size), curvature.reshape(size, size)

    def minimum(self, table: Vector, steps: int) -> tuple[float, Vector]:
        """The minimum near a start, and the numbers there."""
        x = np.clip(table, self.low, self.high)
        value, damping, still = self.value(x), 1e-2, 0
        for _ in range(steps):
            gradient, curvature = self.equations(x)
            for _ in range(12):
                moved = np.clip(
                    x + self._step(x, gradient, curvature, damping), self.low, self.high
                )
                found = self.value(moved)
                if found < value:
                    break
                damping = max(4.0 * damping, 1e-6)
            else:
                break
            still = still + 1 if value - found < 2e-4 else 0
            x, value, damping = moved, found, max(0.25 * damping, 1e-9)
            if still == 3:
                break
        return value, x

    def _step(self, x: Vector, gradient: Vector, curvature: Vector, damping: float) -> Vector:
        """A damped step that follows the bounds instead of crossing them."""
        low, high, flat = self.low.reshape(-1), self.high.reshape(-1), x.reshape(-1)
        diagonal = np.diag(curvature)
        damped = curvature + np.diag(damping * (diagonal + 1e-7 * diagonal.max()))
        free = ~(((flat <= low) & (gradient > 0.0)) | ((flat >= high) & (gradient < 0.0)))
        step = np.zeros_like(flat)
        for _ in range(4):
            step[:] = 0.0
            step[free] = -np.linalg.solve(damped[np.ix_(free, free)], gradient[free])
            out = ((flat <= low) & (step < 0.0)) | ((flat >= high) & (step > 0.0))
            if not out.any():
                break
            free &= ~out
        return step.reshape(x.shape)


def _even(table: Vector) -> tuple[Vector, Vector]:
    """Numbers on scales where steps count alike (logarithms, except bends), and derivatives."""
    shifted = table + np.where(_IS_COLOR, 0.02, 1e-9)
    log = np.log(np.where(_IS_BEND, 1.0, shifted))
    return np.where(_IS_BEND, table, log), 1.0 / np.where(_IS_BEND, 1.0, shifted)


def _smoothness(table: Vector) -> tuple[Vector, Vector]:
    """Gradient and curvature of the sum of squared steps between neighboring nodes."""
    equations, columns = _Equations(), np.arange(len(ROWS))
    gradient, curvature = equations.gradient, equations.curvature
    even, slope = _even(table)
    for k, step in enumerate(np.diff(even, axis=0)):
        ends = (k, -slope[k]), (k + 1, slope[k + 1])
        for i, own in ends:
            gradient[i] += 2.0 * _SMOOTH * own * step
            for j, other in ends:
                curvature[i, columns, j, columns] += 2.0 * _SMOOTH * own * other
    return gradient, curvature


def fit_closures(
    model: Callable[..., Brdf], brdf: Brdf, seed: int, report: Progress
) -> tuple[dict[str, Any], dict[str, float]]:
    """Values of :class:`nacre.standard.closures.Closures` for a reflectance, and facts about the
    fit.

    `model` is that class. If the reflectance conserves energy, so does the mixture at the nodes and
    midway: colors are scaled down where it would reflect more light than it receives. Raises
    NacreError if hardly any value of the reflectance is known.
    """
    rough = _Problem(brdf, seed + 1, rough=True)
    found = []
    for k, roughness in enumerate(_STARTS):
        found.append(rough.minimum(_start(roughness), _FEW))
        report("fitting", k + 1, len(_STARTS) + 1, "")
    problem = _Problem(brdf, seed)
    table = problem.minimum(min(found, key=lambda each: each[0])[1], _ALL)[1]
    table, albedo = _keeping_energy(model, brdf, table)
    views, front, _ = (-10.0 * math.log10(kind.error(table) + 1e-12) for kind in problem.kinds)
    report("fitting", len(_STARTS) + 1, len(_STARTS) + 1, f"{views:.1f} / {front:.1f} dB")
    facts = {"views_psnr": views, "directional_psnr": front, "max_albedo": albedo}
    return _values(table), facts


def _start(roughness: tuple[float, ...]) -> Vector:
    """Gray lobes with constant roughness over a gray base."""
    row = np.where(_IS_COLOR, 0.1, 0.0)
    for columns, each in zip(_SHAPES, roughness, strict=True):
        row[columns] = each
    return np.tile(row, (len(NODES), 1))


def _keeping_energy(model: Callable[..., Brdf], brdf: Brdf, table: Vector) -> tuple[Vector, float]:
    """Numbers with which no view reflects more than 1, unless the reflectance does; the albedo."""
    nodes = np.maximum(NODES, 0.02)  # views along the surface show nothing
    facing = np.sort(np.concatenate([nodes, 0.5 * (nodes[1:] + nodes[:-1])]))
    angles = np.stack([np.arccos(facing), np.zeros_like(facing)])
    limit = np.maximum(albedos(brdf, angles, 16), 1.0)

    def scale() -> Vector:
        seen = albedos(model(**_values(table)), angles, 16)
        return np.asarray(np.minimum(limit / np.maximum(seen, 1e-6), 1.0).min(axis=1))

    table = np.where(_IS_COLOR, table * scale()[::2, None], table)
    between = np.concatenate([[1.0], scale()[1::2], [1.0]])
    table = np.where(_IS_COLOR, table * np.minimum(between[1:], between[:-1])[:, None], table)
    return table, float(albedos(model(**_values(table)), angles, 16).max())


def _values(table: Vector) -> dict[str, Any]:
    ends = np.cumsum([t.rows for t in TABLES])[:-1]
    parts = np.split(table.T, ends)
    return {t.name: part.tolist() for t, part in zip(TABLES, parts, strict=True)}
