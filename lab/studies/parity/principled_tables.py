"""Constants of the Principled BSDF that are not found by quadrature, and where they are from.

    NACRE_BLENDER_PYTHON=... python -m lab.studies.parity.principled_tables sheen OUT.npy
    python -m lab.studies.parity.principled_tables film

`sheen`: the tables of :mod:`nacre.standard.sheen_ltc`, solved for from what Cycles renders. `film`:
the Gaussians of :mod:`nacre.standard.cycles_film`, fitted to the CIE 1931 matching functions.
"""

from __future__ import annotations

import math
import sys

import colour
import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from nacre.color import xyz_to_rgb
from nacre.standard.principled import AnisotropicFilmPrincipled
from tests.oracles.principled import PLAIN, cycles

Array = npt.NDArray[np.float64]

_NODES = 32
_LOWEST = 1e-3  # cosine, at which a viewer still sees the plane, and roughness
_ANGLES = 0.15, 0.4, 0.6, 0.8, 1.0, 1.3, 1.6, 2.6  # between light and view, in one plane
_GAUSSIANS = 5


def sheen() -> npt.NDArray[np.float16]:
    """a, b and albedo by roughness and cosine, shape (3, 32, 32).

    With c = f cos and x, z of the light in the plane of the viewer, the root of z / (pi c) is
    (a x^2 + 2 b x z + (b^2 + 1) z^2 / a) / sqrt(albedo): linear in three unknowns.
    """
    place = np.linspace(0.0, 1.0, _NODES)
    rough, cosine = (
        x.reshape(-1) for x in np.meshgrid(place, np.clip(place, _LOWEST, 0.9999), indexing="ij")
    )
    sine, zero = np.sqrt(1.0 - cosine * cosine), np.zeros_like(cosine)
    normal = np.stack([sine, zero, cosine], axis=-1)
    across = np.stack([zero, zero + 1.0, zero], axis=-1)
    along = np.cross(across, normal)
    frames = np.stack([across, np.cross(normal, across), normal], axis=1)
    values = {
        p.name: np.broadcast_to(PLAIN[p.name], (len(rough), 3) if p.color else rough.shape)
        for p in AnisotropicFilmPrincipled.parameters
    } | {"sheen_weight": zero + 1.0, "sheen_roughness": rough}
    found = cycles(values, np.stack([frames] * len(_ANGLES)), _ANGLES)[..., 1]
    lights = np.stack([(math.sin(a), 0.0, math.cos(a)) for a in _ANGLES])
    toward = along * np.sign(along[:, 2:])  # the viewer
    x, z = lights @ toward.T, lights @ normal.T
    table = np.zeros((3, len(rough)))
    table[:2] = np.nan
    for k, (xk, zk, fk) in enumerate(zip(x.T, z.T, found.T, strict=True)):
        good = (zk > 0.02) & (fk > 1e-9)
        if good.sum() < 3:
            continue  # Cycles leaves out what reflects less than 1e-5
        xk, zk = xk[good], zk[good]
        root = np.sqrt(zk / (math.pi * fk[good]))
        rows = np.stack([xk * xk, xk * zk, zk * zk], axis=1) / root[:, None]
        p, q, r = np.linalg.lstsq(rows, np.ones(len(root)))[0]
        albedo = 1.0 / (p * r - 0.25 * q * q)
        table[:, k] = p * math.sqrt(albedo), 0.5 * q * math.sqrt(albedo), albedo
    table = table.reshape(3, _NODES, _NODES)
    for row in range(_NODES - 2, -1, -1):
        table[:, row] = np.where(np.isnan(table[:, row]), table[:, row + 1], table[:, row])
    # What was rendered near the first nodes lies on lines between these and the next.
    fraction = _LOWEST * (_NODES - 1)
    table[:, :, 0] = (table[:, :, 0] - fraction * table[:, :, 1]) / (1.0 - fraction)
    table[:, 0, 0] = (table[:, 0, 0] - fraction * table[:, 1, 0]) / (1.0 - fraction)
    table[2] = np.clip(table[2], 0.0, 1.0)
    return table.astype(np.float16)


def film() -> tuple[Array, Array, Array]:
    """Wave numbers and deviations of Gaussians in 1/um, shape (5,), and weights, shape (5, 3)."""
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    wave_number = 1e3 / observer.wavelengths
    rgb = xyz_to_rgb(observer.values)
    path = np.linspace(0.0, 3.0, 151)[:, None]  # micrometers
    truth = np.exp(-2j * np.pi * path * wave_number) @ (rgb / rgb.sum(axis=0))

    def transforms(free: Array) -> npt.NDArray[np.complex128]:
        places, deviations = free.reshape(2, -1)
        return np.exp(-2j * np.pi * path * places - 2.0 * (np.pi * deviations * path) ** 2)

    def weights(given: npt.NDArray[np.complex128]) -> Array:
        scale = np.ones((2 * len(path), 1))
        scale[0] = 100.0  # so that they add up to 1
        sides = (scale * np.concatenate([each.real, each.imag]) for each in (given, truth))
        return np.asarray(np.linalg.lstsq(*sides)[0])

    def residuals(free: Array) -> Array:
        given = transforms(free)
        difference = given @ weights(given) - truth
        return np.concatenate([difference.real.reshape(-1), difference.imag.reshape(-1)])

    random, best = np.random.default_rng(0), None
    bounds = np.repeat([1.3, 0.02], _GAUSSIANS), np.repeat([2.7, 0.4], _GAUSSIANS)
    for _ in range(12):
        places, deviations = random.uniform(1.5, 2.4, _GAUSSIANS), random.uniform(0.04, 0.15, 5)
        start = np.concatenate([np.sort(places), deviations])
        found = least_squares(residuals, start, bounds=bounds, max_nfev=200)
        if best is None or found.cost < best.cost:
            best = found
    assert best is not None
    places, deviations = best.x.reshape(2, -1)
    print(f"largest error of a transform: {np.abs(residuals(best.x)).max():.4f}")
    return places, deviations, weights(transforms(best.x))


if __name__ == "__main__":
    if sys.argv[1] == "sheen":
        np.save(sys.argv[2], sheen())
    else:
        for row in zip(*film(), strict=True):
            print(*(np.round(x, 4).tolist() for x in row))
