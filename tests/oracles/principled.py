"""The Principled node of Cycles and ours, at random parameters and directions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.geometry import join, split
from nacre.standard.principled import AnisotropicFilmPrincipled
from tests.oracles.blender import principled

ANGLES = 0.15, 0.8, 1.6, 2.6
"""Between light and view, in radians."""

VIEWS = 0.3, 1.2
"""Between normal and view, in radians."""

PLAIN = {"base_color": 0.0, "metallic": 0.0, "roughness": 0.5, "ior": 1.5, "specular_tint": 1.0}
PLAIN |= {"specular_ior_level": 0.0, "diffuse_roughness": 0.0, "anisotropic": 0.0}
PLAIN |= {"coat_weight": 0.0, "coat_roughness": 0.03, "coat_ior": 1.5, "coat_tint": 1.0}
PLAIN |= {"sheen_weight": 0.0, "sheen_roughness": 0.5, "sheen_tint": 1.0}
PLAIN |= {"anisotropic_rotation": 0.0, "thin_film_thickness": 0.0, "thin_film_ior": 1.33}
"""Of a node that reflects nothing."""

_METAL = ("base_color", "metallic", "roughness", "specular_tint")
_SPECULAR = ("roughness", "ior", "specular_ior_level", "specular_tint")
_COAT = ("coat_weight", "coat_roughness", "coat_ior", "coat_tint")
_SHEEN = ("sheen_weight", "sheen_roughness", "sheen_tint")
_SMOOTH = ("roughness", "coat_roughness")
_FILM = ("thin_film_thickness", "thin_film_ior")
_AXES = ("anisotropic", "anisotropic_rotation")
CASES: dict[str, tuple[str, ...]] = {
    "diffuse": ("base_color", "diffuse_roughness"),
    "metal": _METAL,
    "anisotropic metal": (*_METAL, *_AXES),
    "specular": _SPECULAR,
    "specular and diffuse": (*_SPECULAR, "base_color"),
    "coat": _COAT,
    "coat over diffuse": (*_COAT, "base_color"),
    "sheen": _SHEEN,
    "sheen over diffuse": (*_SHEEN, "base_color"),
    "all": (),
    "film on metal": (*_METAL, *_FILM),
    "film on a dielectric": (*_SPECULAR, *_FILM, "base_color"),
    "all and a film": (),
}
"""What is random of the node; nothing stands for all."""


def cycles(
    values: Mapping[str, Floats], frames: Floats, angles: Sequence[float] = ANGLES
) -> Floats:
    """The product f cos of each set of parameters as Cycles renders it.

    Parameters
    ----------
    values
        By our names, shape (n,) or (n, 3).
    frames
        Tangents, bitangents and normals for each of the angles where the view is +z and the
        light lies toward +x, shape (angles, n, 3, 3).
    angles
        Between light and view.

    Returns
    -------
    Shape (angles, n, 3), in 1/sr
    """
    inputs = {socket(name): value for name, value in values.items()}
    frame = {"normals": frames[:, :, 2], "tangents": frames[:, :, 0]}
    return principled({**inputs, **frame, "angles": np.array(angles)}) / np.float32(math.pi)


def socket(name: str) -> str:
    """Identifier of the node's input that a parameter stands for."""
    return name.replace("_", " ").title().replace("Ior", "IOR")


def ours(values: Mapping[str, Floats], frames: Floats) -> Floats:
    """The same by our formula, in double precision."""
    given = {
        name: tuple(np.moveaxis(v, -1, 0)) if v.ndim == 2 else v
        for name, v in values.items()
        if name not in _FILM or values[_FILM[0]].any()
    }
    found = []
    for angle, axes in zip(ANGLES, frames, strict=True):
        wo = axes[:, :, 2]
        wi = axes @ (math.sin(angle), 0.0, math.cos(angle))
        rgb = join(AnisotropicFilmPrincipled.formula(given, split(wi), split(wo)))
        found.append(np.maximum(rgb, 0.0) * wi[:, 2:])
    return np.stack(found)


def random_frames(count: int, random: np.random.Generator) -> npt.NDArray[np.float64]:
    """Frames whose normals light and view see, as in :func:`cycles`."""
    frames = []
    for angle in ANGLES:
        normals = random.normal(size=(40 * count, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        seen = np.minimum(normals @ (math.sin(angle), 0.0, math.cos(angle)), normals[:, 2])
        normals = normals[seen > 0.02][:count].astype(np.float32).astype(np.float64)
        tangents = np.cross(random.normal(size=normals.shape), normals)
        tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
        frames.append(np.stack([tangents, np.cross(normals, tangents), normals], axis=1))
    return np.stack(frames)


def random_values(count: int, random: np.random.Generator) -> dict[str, npt.NDArray[np.float64]]:
    """Parameters, each anywhere between its bounds, but indices below 3 and facets of a roughness
    above 0.15, where single precision resolves their slopes.
    """
    found = {}
    for p in AnisotropicFilmPrincipled.parameters:
        high = min(p.high, 3.0) if p.name.endswith("ior") else p.high
        low = 0.15 if p.name in _SMOOTH else p.low
        shape = (count, 3) if p.color else (count,)
        numbers = random.uniform(low, high, shape).astype(np.float32)
        found[p.name] = numbers.astype(np.float64)
    return found


def errors(found: Floats, truth: Floats) -> Floats:
    """Of each pixel, the largest difference of a channel over the largest channel."""
    scale = np.maximum(truth.max(axis=-1), 1e-3)
    return np.asarray(np.abs(found - truth).max(axis=-1) / scale)


def case(name: str, count: int, random: np.random.Generator) -> Floats:
    """Errors of one of :data:`CASES` at so many sets of parameters, shape (angles, count)."""
    values, frames = random_values(count, random), random_frames(count, random)
    varied = set(CASES[name] or values)
    for other in values:
        if other not in varied or (other in _FILM and "film" not in name):
            values[other] = np.broadcast_to(PLAIN[other], values[other].shape)
    return errors(ours(values, frames), cycles(values, frames))


def furnace(count: int, samples: int, random: np.random.Generator) -> tuple[Floats, Floats]:
    """Albedos of so many sets of parameters without anisotropy as Cycles finds them under a white
    sky, and ours, shapes (views, count, 3).
    """
    values = random_values(count, random)
    for name in (*_AXES, *_FILM):
        values[name] = np.broadcast_to(PLAIN[name], values[name].shape)
    for name in _SMOOTH:
        values[name] = np.maximum(values[name], 0.35)  # what the quadrature below resolves
    inputs = {socket(name): value for name, value in values.items()}
    given = {**inputs, "angles": np.array(VIEWS), "samples": np.array(samples)}
    nodes, weights = np.polynomial.legendre.leggauss(96)
    theta, phi = 0.25 * math.pi * (nodes + 1.0), (np.arange(96) + 0.5) * (math.pi / 96)
    theta, phi = (x.reshape(-1, 1) for x in np.meshgrid(theta, phi, indexing="ij"))
    weights = np.repeat(weights, 96)[:, None] * (math.pi**2 / 192) * np.sin(2.0 * theta)
    wi = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)
    numbers = {
        name: tuple(v.T) if v.ndim == 2 else v
        for name, v in values.items()
        if name not in (*_AXES, *_FILM)
    }
    found = []
    for view in VIEWS:
        wo = (np.full((1, 1), x) for x in (math.sin(view), 0.0, math.cos(view)))
        rgb = AnisotropicFilmPrincipled.formula(numbers, wi, tuple(wo))
        found.append(np.stack([(0.5 * weights * c).sum(axis=0) for c in rgb], axis=-1))
    return principled(given), np.stack(found)
