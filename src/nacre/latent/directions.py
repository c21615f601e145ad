"""Pairs of directions at which materials of all kinds are seen alike."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from nacre.array import Weights
from nacre.brdf import Brdf
from nacre.errors import FormatError, NacreError
from nacre.geometry import cosine_hemisphere, join, split, uniform_hemisphere, uniform_rusinkiewicz
from nacre.neural.inputs import network_inputs
from nacre.runtime.progress import Progress
from nacre.sampling import BlinnPhongMixture

_EXPONENTS = np.geomspace(1.0, 1e5, 12)
_HORIZON = 1e-3  # least cosine: closer to the horizon, tables and networks hold anything


def shared_directions(count: int, seed: int) -> tuple[Weights, Weights]:
    """Directions to the light and to the viewer, shapes (count, 3), for any isotropic material.

    Half are uniform in the Rusinkiewicz angles. The others are as a picture of a sphere shows them:
    views as dense as the cosine, half of them with light from anywhere in the sky, half with light
    about the mirror direction in lobes from broad to sharp.
    """
    found = np.empty((2, 0, 3), np.float32)
    random = np.random.default_rng((seed, 3))
    while found.shape[1] < count:
        u = random.random((5, 2 * count), dtype=np.float32)
        wi, wo = (np.array(np.broadcast_arrays(*w)) for w in uniform_rusinkiewicz(_unturned(u)))
        seen = np.array(cosine_hemisphere(u[0], u[1]))
        light = np.array(uniform_hemisphere(u[2], u[3]))
        for index, exponent in enumerate(_EXPONENTS):
            part = np.s_[:, 3 + 4 * index :: 4 * len(_EXPONENTS)]
            lobe = BlinnPhongMixture(1.0, float(exponent))
            light[part] = lobe.sample_components(tuple(seen[part]), tuple(u[2:][part]))[0]
        wi[:, 1::2], wo[:, 1::2] = light[:, 1::2], seen[:, 1::2]
        pairs = np.stack([join(tuple(wi)), join(tuple(wo))]).astype(np.float32)
        found = np.concatenate([found, pairs[:, (pairs[:, :, 2] > _HORIZON).all(axis=0)]], axis=1)
    return found[0, :count], found[1, :count]


def isotropic_inputs(wi: npt.ArrayLike, wo: npt.ArrayLike, inputs: str) -> Weights:
    """Network inputs of an isotropic material, shape (n, 6), for directions (n, 3).

    `inputs` is "paper" or "enhanced"; see :func:`nacre.neural.inputs.network_inputs`.
    """
    values = network_inputs(split(wi), split(wo), True, inputs)
    return np.stack(np.broadcast_arrays(*values), axis=-1).astype(np.float32)


def isotropic_values(brdf: Brdf, wi: npt.ArrayLike, wo: npt.ArrayLike) -> Weights:
    """f_r of an isotropic reflectance in 1/sr, shape (n, 3), float32; -1 where it is not known.

    Raises FormatError if `brdf` is anisotropic, NacreError if it is known at none of the
    directions.
    """
    check_isotropic(brdf)
    known = brdf.valid(wi, wo)
    if not known.any():
        raise NacreError(f"{brdf.name or 'reflectance'}: is known at none of the directions")
    return np.where(known[:, None], brdf.eval(wi, wo), -1.0).astype(np.float32)


def sampled(
    materials: Sequence[Callable[[], Brdf]], wi: Weights, wo: Weights, report: Progress
) -> tuple[list[Weights], list[str]]:
    """:func:`isotropic_values` of each of several materials at directions (n, 3), and their names.

    `materials` are functions that return them, each called once.
    """
    values, names = [], []
    for index, load in enumerate(materials):
        brdf = load()
        values.append(isotropic_values(brdf, wi, wo))
        names.append(brdf.name)
        report("sampling", index + 1, len(materials), brdf.name)
    return values, names


def check_isotropic(brdf: Brdf) -> None:
    """Raise FormatError for an anisotropic material, which has no code."""
    if not brdf.isotropic:
        name = brdf.name or "reflectance"
        raise FormatError(f"{name}: is anisotropic; codes are for isotropic materials")


def _unturned(u: Weights) -> Weights:
    turned = u[:4].copy()
    turned[1] = 0.0
    return turned
