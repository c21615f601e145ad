"""Mitsuba integrators for light from an environment: mixtures, resampling, and products.

Where a path meets a surface, a strategy returns directions to the light. For each of them f_r is
evaluated once and one shadow ray is traced. A material is known by `sample`, `pdf` and `eval` only,
so any Mitsuba BSDF with a density works; the only light is a scene's environment.
"""

from __future__ import annotations

import abc
from functools import cache
from typing import Any

from nacre.array import Array
from nacre.errors import require
from nacre.mitsuba.engine import mitsuba
from nacre_lab.sampling.light_cells import LightCells

_LEAST = 1e-2
"""Share of cells' chances that follows from their light alone, so that none is left out."""


class Hit:
    """Where paths met surfaces: what strategies may ask about it."""

    def __init__(self, mi: Any, si: Any, bsdf: Any, sampler: Any, sky: Any, active: Any) -> None:
        self.mi, self.si, self.active = mi, si, active
        self._bsdf, self._sampler, self._sky, self._context = bsdf, sampler, sky, mi.BSDFContext()

    def number(self) -> Any:
        """A uniform random number in [0, 1)."""
        return self._sampler.next_1d(self.active)

    def lobes(self, w: Any) -> Any:
        """Density of the material's own sampler at a direction in the world."""
        return self._bsdf.pdf(self._context, self.si, self.si.to_local(w), self.active)

    def draw_lobes(self) -> tuple[Any, Any]:
        """A direction in the world from the material's own sampler, and its density; 0 is none."""
        u, v = self.number(), self._sampler.next_2d(self.active)
        drawn, _ = self._bsdf.sample(self._context, self.si, u, v, self.active)
        return self.si.to_world(drawn.wo), drawn.pdf

    def draw_light(self, cells: LightCells, cell: Any) -> Any:
        """A direction in the world from a cell of the light."""
        u = self.number(), self.number(), self.number(), self.number()
        return self.mi.Vector3f(*cells.sample_components(cell, u))

    def radiance(self, w: Any) -> Any:
        """Spectrum of the environment's light from a direction in the world."""
        si = require("drjit", "render").zeros(self.mi.SurfaceInteraction3f)
        si.wi, si.wavelengths = -w, self.si.wavelengths
        return self._sky.eval(si, self.active)


class Strategy(abc.ABC):
    """How directions to the light are found."""

    @abc.abstractmethod
    def draw(self, hit: Hit) -> list[tuple[Any, Array]]:
        """Directions in the world, each with the factor of its light in the estimate: one over its
        density where there is one direction. All estimate the whole light together.
        """


class Separate(Strategy):
    """A direction from a material's own sampler, from the light, or one from each.

    What both may find is weighted by the power heuristic, as by Mitsuba's `direct` and `path`.

    Parameters
    ----------
    light
        The environment as one cell; None for the material only.
    material
        Whether the material's sampler is used.
    """

    def __init__(self, light: LightCells | None, material: bool = True) -> None:
        self._light, self._material = light, material

    def draw(self, hit: Hit) -> list[tuple[Any, Array]]:
        dr: Any = require("drjit", "render")
        found: list[tuple[Any, Any, Any]] = []
        if self._material:
            w, mine = hit.draw_lobes()
            found.append((w, mine, self._light and density(self._light, w)[1]))
        if self._light:
            w = hit.draw_light(self._light, hit.mi.UInt32(0))
            mine = density(self._light, w)[1]
            found.append((w, mine, hit.lobes(w) if self._material else None))
        return [
            (w, dr.select(p > 0.0, 1.0 / p if q is None else p / (p * p + q * q), 0.0))
            for w, p, q in found
        ]


class Product(Strategy):
    """Directions from a material's own sampler, and from cells of light that its lobes select.

    A cell's chance is its light times the density of the material's sampler at the cell's middle:
    the product of light and lobes at the resolution of the cells. Chances are found once for each
    hit, then serve all its directions; those from cells are stratified. Both kinds are weighted by
    the balance heuristic.

    Parameters
    ----------
    cells
        The light.
    material, product
        Directions from each, or where there is none, one direction from either, chosen evenly.
    """

    def __init__(self, cells: LightCells, material: int = 0, product: int = 0) -> None:
        self._cells, self._material, self._product = cells, material, product

    def draw(self, hit: Hit) -> list[tuple[Any, Array]]:
        dr: Any = require("drjit", "render")
        mi, strata = hit.mi, max(self._product, 1)
        sums, total = self._chances(hit)

        def from_cells(stratum: int) -> Any:
            aim = (stratum + hit.number()) * (total / strata)
            return hit.draw_light(self._cells, _search(mi, sums, aim))

        drawn = [hit.draw_lobes()[0] for _ in range(self._material)]
        drawn += [from_cells(stratum) for stratum in range(self._product)]
        share = self._material / len(drawn) if drawn else 0.5
        if not drawn:
            drawn = [dr.select(hit.number() < share, hit.draw_lobes()[0], from_cells(0))]
        result = []
        for w in drawn:
            cell, within = density(self._cells, w)
            before = dr.select(cell > 0, sums[dr.maximum(cell, 1) - 1], 0.0)
            chosen = within * (sums[cell] - before) / total
            mixed = share * hit.lobes(w) + (1.0 - share) * chosen
            result.append((w, dr.select(mixed > 0.0, 1.0 / mixed, 0.0) / len(drawn)))
        return result

    def _chances(self, hit: Hit) -> tuple[Any, Any]:
        """Cumulative sums over cells in local memory, and the last of them."""
        dr: Any = require("drjit", "render")
        mi, energies = hit.mi, self._cells.energies
        own = mi.Float((energies / energies.sum()).tolist())
        middles = [mi.Float(column.tolist()) for column in self._cells.middles.T]
        sums = dr.alloc_local(mi.Float, len(energies))

        def body(index: Any, total: Any, sums: Any) -> tuple[Any, Any, Any]:
            w = mi.Vector3f(*(dr.gather(mi.Float, column, index) for column in middles))
            total = total + dr.gather(mi.Float, own, index) * (hit.lobes(w) + _LEAST)
            sums[index] = total
            return index + 1, total, sums

        start = mi.UInt32(0), mi.Float(0.0), sums
        _, total, sums = dr.while_loop(
            start, lambda index, total, sums: index < len(energies), body, mode="symbolic"
        )
        return sums, total


class Resampling(Strategy):
    """One of several candidates, half from lobes and half from the light.

    It is chosen by the product of both densities (Talbot et al. 2005, "Importance Resampling for
    Global Illumination"), so that f_r and the light are looked up once.
    """

    def __init__(self, cells: LightCells, pairs: int = 4) -> None:
        self._cells, self._pairs = cells, pairs

    def draw(self, hit: Hit) -> list[tuple[Any, Array]]:
        dr: Any = require("drjit", "render")
        mi = hit.mi
        total, kept, aim = mi.Float(0.0), mi.Vector3f(0.0), mi.Float(1.0)
        for index in range(2 * self._pairs):
            if index % 2:
                w, lobes = hit.draw_lobes()
            else:
                w = hit.draw_light(self._cells, mi.UInt32(0))
                lobes = hit.lobes(w)
            light = density(self._cells, w)[1]
            weight = dr.select(lobes > 0.0, 2.0 * lobes * light / (lobes + light), 0.0)
            total = total + weight
            taken = hit.number() * total < weight
            kept, aim = dr.select(taken, w, kept), dr.select(taken, lobes * light, aim)
        return [(kept, total / (2 * self._pairs * aim))]


def density(cells: LightCells, w: Any) -> tuple[Array, Array]:
    """The cell of a direction in the world, and its density there."""
    return cells.at_components((w.x, w.y, w.z))


def _search(mi: Any, sums: Any, aim: Any) -> Any:
    """The first index whose sum is more than `aim`, else the last."""
    low, step = mi.UInt32(0), 1 << max(len(sums) - 1, 1).bit_length() - 1
    dr: Any = require("drjit", "render")
    while step:
        beyond = low + step
        inside = beyond < len(sums)
        before = sums[dr.select(inside, beyond, 1) - 1]
        low = dr.select(inside & (before <= aim), beyond, low)
        step //= 2
    return low


@cache
def _integrator(variant: str) -> Any:
    """The integrator's class for a variant, which is set."""
    mi: Any = require("mitsuba", "render")
    dr: Any = require("drjit", "render")

    class EnvironmentLight(mi.SamplingIntegrator):  # type: ignore[misc]
        def __init__(self, strategy: Strategy, bsdf: Any) -> None:
            super().__init__(mi.Properties())
            self._strategy, self._bsdf = strategy, bsdf

        def sample(
            self, scene: Any, sampler: Any, ray: Any, medium: Any = None, active: Any = True
        ) -> tuple[Any, Any, list[Any]]:
            si = scene.ray_intersect(ray, active)
            sky, hits = scene.environment(), active & si.is_valid()
            background = sky.eval(si, active & ~hits)
            light = mi.Spectrum(0.0)
            hit = Hit(mi, si, self._bsdf, sampler, sky, hits)
            for w, factor in self._strategy.draw(hit):
                lit = hits & (factor > 0.0)
                value = self._bsdf.eval(mi.BSDFContext(), si, si.to_local(w), lit)
                lit &= ~scene.ray_test(si.spawn_ray(w), lit)
                light += dr.select(lit, value * hit.radiance(w) * factor, 0.0)
            return dr.select(hits, light, background), mi.Bool(active), []

    return EnvironmentLight


def integrator(strategy: Strategy, bsdf: Any) -> Any:
    """A Mitsuba integrator of direct light from a scene's environment, which has no `to_world`.

    All surfaces have one BSDF, which is called directly: kernels do not depend on what other
    materials are in memory. If no variant is set, this sets the one that
    :func:`nacre.mitsuba.mitsuba` starts with.
    """
    return _integrator(mitsuba().variant())(strategy, bsdf)
