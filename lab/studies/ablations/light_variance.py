"""How much noise ways to sample an environment leave, by quadrature: no picture, no timing.

The sphere and the error are those of :mod:`lab.studies.ablations.product_sampling`, without what
changes within a pixel, at directions of the museum in half resolution. Beside the strategies there
it has what no sampler does: optimal weights (Kondapaneni et al. 2019, "Optimal Multiple Importance
Sampling") with the best coefficients of each point, lobes times the light, and f_r times the light.

Run `python -m lab.studies.ablations.light_variance [material ...]`.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from lab.studies.ablations.sampling import DARK, PATHS, tabulated
from lab.studies.study import Study, log, museum, rgl_names
from nacre.array import Doubles
from nacre.brdf import Brdf
from nacre.color import luminance
from nacre.geometry import split
from nacre.mitsuba.environment import Environment, pixel_directions
from nacre.mitsuba.sphere import frames
from nacre.sampling import fit_lobes
from nacre_lab.sampling.light_cells import LightCells

CELLS = 32, 128, 512
_GOLDEN = math.pi * (3.0 - math.sqrt(5.0))


class Point(NamedTuple):
    """A place on the sphere: functions of directions to the light, and how these are weighted."""

    integrand: Doubles  # f_r times the cosine and the light, shape (n, 3)
    lobes: Doubles  # density, shape (n,)
    light: Doubles  # likewise
    cells: dict[int, Doubles]  # likewise, by the number of cells
    product: Doubles  # lobes times light, a density
    solid_angle: Doubles  # shape (n,)

    def second(self, density: Doubles, weight: Doubles | float = 1.0) -> Doubles:
        """Second moment of directions from a density, whose part of the light is weighted."""
        part = self.integrand * np.reshape(weight, (-1, 1))
        inverse = np.divide(1.0, density, out=np.zeros_like(density), where=density > 0.0)
        return np.asarray((part * part * (inverse * self.solid_angle)[:, None]).sum(0))

    def mean(self, weight: Doubles | float = 1.0) -> Doubles:
        """What it estimates, shape (3,)."""
        part = self.integrand * np.reshape(weight, (-1, 1))
        return np.asarray((part * self.solid_angle[:, None]).sum(0))


def half(environment: Environment) -> Environment:
    """With means of 2 x 2 pixels."""
    pixels = environment.pixels
    return Environment(np.mean([pixels[i::2, j::2] for i in (0, 1) for j in (0, 1)], 0))


def points(brdf: Brdf, environment: Environment, count: int) -> Iterator[Point]:
    """Evenly over the disk of a sphere that is seen from +z."""
    directions, solid_angle = pixel_directions(*environment.pixels.shape[:2])
    solid_angle = np.repeat(solid_angle, directions.shape[1])
    directions, radiance = directions.reshape(-1, 3), environment.pixels.reshape(-1, 3)
    bright = luminance((radiance[:, 0], radiance[:, 1], radiance[:, 2]))
    whole, *parts = (LightCells(environment, number) for number in (1, *CELLS))
    _, light = whole.at_components(split(directions))
    found = [cells.at_components(split(directions)) for cells in parts]
    for index in range(count):
        radius, phi = math.sqrt((index + 0.5) / count), index * _GOLDEN
        normal = radius * math.cos(phi), radius * math.sin(phi), math.sqrt(1.0 - radius**2)
        (frame,) = frames(np.array([normal]))
        wo, wi = frame[:, 2], directions @ frame.T
        lobes = brdf.pdf(wi.astype(np.float32), wo.astype(np.float32)).astype(float)
        values = brdf.eval(wi.astype(np.float32), wo.astype(np.float32)).astype(float)
        chances = {}
        for cells, (cell, within) in zip(parts, found, strict=True):
            middles = (cells.middles @ frame.T).astype(np.float32)
            weights = cells.energies * (brdf.pdf(middles, wo.astype(np.float32)) + 0.01)
            chances[len(middles)] = (weights / weights.sum())[cell] * within
        product = lobes * bright
        yield Point(
            values * radiance * np.maximum(wi[:, 2:], 0.0),
            lobes,
            light,
            chances,
            product / (product * solid_angle).sum(),
            solid_angle,
        )


def variances(point: Point) -> dict[str, Doubles]:
    """Of one direction, or of one from each of two, by way; shape (3,)."""
    mean, lobes, light = point.mean(), point.lobes, point.light

    def one(density: Doubles) -> Doubles:
        return point.second(density) - mean**2

    def two(share: Doubles) -> Doubles:
        parts = (lobes, share), (light, 1.0 - share)
        return np.asarray(sum(point.second(p, w) - point.mean(w) ** 2 for p, w in parts))

    total = lobes + light
    bright = luminance((point.integrand[:, 0], point.integrand[:, 1], point.integrand[:, 2]))
    return {
        "material": one(lobes),
        "light": one(light),
        "one of the two": one(0.5 * total),
        "material and light": two(lobes**2 / (lobes**2 + light**2)),
        "the same, balance heuristic": two(lobes / total),
        "the same, optimal weights": optimal(point),
        **{
            f"one of material and product, {number} cells": one(0.5 * (lobes + density))
            for number, density in point.cells.items()
        },
        "lobes times light": one(0.02 * lobes + 0.98 * point.product),
        "f_r times light": one(bright / (bright * point.solid_angle).sum()),
    }


def optimal(point: Point) -> Doubles:
    """Least variance of one direction from the material and one from the light."""
    densities, area = np.stack([point.lobes, point.light]), point.solid_angle
    total = densities.sum(0)
    system = np.einsum("in,jn,n->ij", densities, densities / total, area)
    sides = np.einsum("in,nc,n->ic", densities / total, point.integrand, area)
    rest = point.integrand - densities.T @ np.linalg.lstsq(system, sides, rcond=None)[0]
    rest /= total[:, None]
    moments = (np.einsum("nc,n,n->c", rest**k, p, area) for p in densities for k in (2, 1))
    second, first, other, mean = moments
    return np.asarray(second - first**2 + other - mean**2)


def errors(brdf: Brdf, environment: Environment, count: int) -> dict[str, float]:
    """Relative error of 64 directions, or pairs, by way."""
    every = list(points(brdf, environment, count))
    means = np.stack([point.mean() for point in every])
    floor = means**2 + (DARK * means.mean()) ** 2
    found = [variances(point) for point in every]
    return {
        way: math.sqrt(float((np.stack([each[way] for each in found]) / floor).mean()) / PATHS)
        for way in found[0]
    }


def main() -> None:
    """Print errors by way and material."""
    study = Study(__doc__, __file__)
    study.add_argument("materials", nargs="*", metavar="material", help="all by default")
    study.add_argument("--points", type=int, default=20, help="on the sphere")
    options = study.options()
    light, results = half(museum()), {}
    for material in options.materials or study.few(rgl_names()):
        _, table = tabulated(material)
        sampled = table.replaced(sampler=fit_lobes(table))
        results[material] = errors(sampled, light, options.points)
        log(material)
    rows = [
        (way, *(f"{value:.3f}" for value in (statistics.median(values), *values)))
        for way in next(iter(results.values()))
        if (values := [found[way] for found in results.values()])
    ]
    study.table(("directions from", "median", *results), rows)


if __name__ == "__main__":
    main()
