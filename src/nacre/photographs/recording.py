"""Pictures as sums over directions: the light that a material reflects to each pixel.

A pixel shows a sum of f_r at pairs of directions times weights from the scene. Once these are
recorded, the picture of any material is such a sum. Light that the material itself reflects more
than once is recorded for the material that is in the scene.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.brdf import Sampler
from nacre.errors import NacreError, require
from nacre.mitsuba import adapter
from nacre.mitsuba.engine import mitsuba
from nacre.sampling import GgxLobe, GgxMixture

MAX_EDGE = 96
"""Recorded pixels along an edge; larger pictures are averaged over blocks."""
MAX_PIXELS = 1500
"""Recorded pixels of a picture; more would tell little more about one material."""
SAMPLES = 144
"""Directions to the light per pixel from each of both ways of sampling."""

_PROBES = 16  # rays that must all hit the material for a pixel to be used
_DEPTH = 8
_COSINES = 0.1, 0.45, 1.0


def _lobe(fraction: float, roughness: float) -> GgxLobe:
    return GgxLobe((fraction,) * 3, (roughness,) * 3, (roughness,) * 3, (0.0,) * 3)


LOBES = GgxMixture(
    (_lobe(0.3, 0.02), _lobe(0.2, 0.08), _lobe(0.2, 0.3)), (0.1,) * 3, (0.2,) * 3, _COSINES, None
)
"""For an unknown material, from mirrors to cloth."""


@dataclass(frozen=True)
class Recording:
    """The pixels that show only one material, as sums.

    Parameters
    ----------
    pixels
        Rows and columns, shape (n, 2), in the picture from :func:`shrunk`.
    wi, wo
        Unit directions to the light and to the viewer in the frame of the surface, shape (n, s, 3),
        float32.
    weights
        Of f_r, linear RGB, shape (n, s, 3), float32.
    """

    pixels: npt.NDArray[np.intp]
    wi: npt.NDArray[np.float32]
    wo: npt.NDArray[np.float32]
    weights: npt.NDArray[np.float32]


def block(size: tuple[int, int]) -> int:
    """Pixels along the edge of the blocks that are recorded, for a height and width."""
    return -(-max(size) // MAX_EDGE)


def shrunk(image: npt.NDArray[np.floating]) -> npt.NDArray[np.float64]:
    """Means of the blocks in a picture (height, width, 3); incomplete blocks are cut off."""
    edge = block((image.shape[0], image.shape[1]))
    height, width = (n // edge for n in image.shape[:2])
    whole = image[: height * edge, : width * edge].astype(np.float64)
    with np.errstate(invalid="ignore"):  # infinities of both signs
        return np.asarray(whole.reshape(height, edge, width, edge, 3).mean(axis=(1, 3)))


def record(
    scene: Any,
    sensor: int,
    bsdf: Any,
    size: tuple[int, int],
    lobes: Sampler = LOBES,
    samples: int = SAMPLES,
    seed: int = 0,
) -> Recording:
    """Record a picture.

    Parameters
    ----------
    scene
        A Mitsuba scene, in a JIT variant with RGB.
    sensor
        Index of the camera.
    bsdf
        The material's object in the scene; its reflectance matters only where its shapes light each
        other.
    size
        Height and width of the picture in pixels.
    lobes
        For choosing directions to the light: close to the material's, if known.
    samples
        Rays per pixel, each with light from the emitters and along the lobes.
    seed
        For the rays.

    Raises
    ------
    NacreError
        If no pixel shows only the front of the material, or no light reaches it.
    """
    dr = require("drjit", "render")
    edge = block(size)
    height, width = (n // edge for n in size)
    if not height * width:
        raise NacreError(f"a picture of {size[1]} x {size[0]} pixels is too narrow")
    camera = _Camera(scene, sensor, bsdf, edge, size)
    everywhere = np.arange(height * width)
    _, hit, _ = camera.rays(everywhere % width, everywhere // width, _PROBES, seed)
    seen = np.flatnonzero(np.array(hit).reshape(-1, _PROBES).all(axis=1))
    if not seen.size:
        raise NacreError("no pixel shows the front of the material alone")
    seen = np.sort(np.random.default_rng(seed).permutation(seen)[:MAX_PIXELS])
    si, hit, sampler = camera.rays(seen % width, seen // width, samples, seed + 1)
    parts = list(_light(scene, si, hit, sampler, lobes))
    wi, weights = [], []
    for direction, value, active in parts:
        use = active & (direction.z > 0.0)
        wi.append(_rows(dr.select(use, direction, si.wi), samples))
        weights.append(_rows(dr.select(use, value * direction.z, 0.0) / samples, samples))
    recording = Recording(
        np.stack([seen // width, seen % width], axis=1),
        np.concatenate(wi, axis=1),
        np.concatenate([_rows(si.wi, samples)] * len(wi), axis=1),
        np.concatenate(weights, axis=1),
    )
    if not recording.weights.any():
        raise NacreError("no light reaches the material")
    return recording


class _Camera:
    """Finds where rays through blocks of pixels hit a material."""

    def __init__(
        self, scene: Any, sensor: int, bsdf: Any, edge: int, size: tuple[int, int]
    ) -> None:
        self._scene, self._camera = scene, scene.sensors()[sensor]
        self._bsdf, self._edge, self._size = bsdf, edge, size

    def rays(self, column: Any, row: Any, samples: int, seed: int) -> tuple[Any, Any, Any]:
        """Surface hits, whether they are on the material's front, and the sampler."""
        mi, dr = mitsuba(), require("drjit", "render")
        sampler = mi.load_dict({"type": "multijitter", "sample_count": samples})
        sampler.set_samples_per_wavefront(samples)
        count = len(column) * samples
        sampler.seed(seed % (1 << 32), count)
        pixel = dr.arange(mi.UInt32, count) // samples
        corner = mi.Point2f(*(dr.gather(mi.Float, mi.Float(v), pixel) for v in (column, row)))
        height, width = self._size
        place = (corner + sampler.next_2d()) * self._edge / mi.Point2f(width, height)
        ray, _ = self._camera.sample_ray(0.0, 0.5, place, sampler.next_2d())
        si = self._scene.ray_intersect(ray)
        hit = si.is_valid() & (si.bsdf() == mi.BSDFPtr(self._bsdf))
        return si, hit & (mi.Frame3f.cos_theta(si.wi) > 0.0), sampler


def _light(scene: Any, si: Any, hit: Any, sampler: Any, lobes: Sampler) -> Any:
    """Directions to the light, radiance over density, and where these exist."""
    mi, dr = mitsuba(), require("drjit", "render")
    given: Any = adapter.components(*si.wi)
    direct, radiance = scene.sample_emitter_direction(si, sampler.next_2d(), True, hit)
    toward = si.to_local(direct.d)
    density = lobes.pdf_components(adapter.components(*toward), given)
    weight = dr.select(direct.delta, 1.0, direct.pdf / (direct.pdf + density))
    yield toward, radiance * weight, hit & (direct.pdf > 0.0)
    u: Any = adapter.components(sampler.next_1d(), *sampler.next_2d())
    other, density = lobes.sample_components(given, u)
    drawn = mi.Vector3f(*other)
    possible = hit & (drawn.z > 0.0) & (density > 0.0)
    ray = si.spawn_ray(si.to_world(drawn))
    found = scene.ray_intersect(ray, possible)
    emitter = found.emitter(scene)
    shines = possible & (emitter != None)  # noqa: E711  # of arrays
    met = mi.DirectionSample3f(scene, found, si)
    total = scene.pdf_emitter_direction(si, met, shines) + density
    own = dr.select(shines, emitter.eval(found, shines), 0.0)
    value = own / dr.select(shines, total, 1.0)
    surface = possible & found.is_valid()
    if dr.any(surface):
        # An integrator looks through emitters that it hides.
        path = mi.load_dict({"type": "path", "max_depth": _DEPTH})
        all_of_it, _, _ = path.sample(scene, sampler, ray, None, surface)
        value += dr.select(surface, dr.maximum(all_of_it - own, 0.0) / density, 0.0)
    yield drawn, value, possible


def _rows(vectors: Any, samples: int) -> npt.NDArray[np.float32]:
    """Vectors of rays, shape (n, samples, 3)."""
    values = np.stack([np.array(part, np.float32) for part in vectors], axis=-1)
    return values.reshape(-1, samples, 3)


def sphere_scene(environment: Any, size: int) -> dict[str, Any]:
    """The view of :mod:`nacre.mitsuba.sphere` as a Mitsuba dictionary, under an emitter's
    dictionary.
    """
    mi = mitsuba()
    from nacre.mitsuba.sphere import MARGIN

    half = 1.0 / (1.0 - MARGIN)
    view = mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])
    upright = mi.ScalarTransform4f().rotate([1, 0, 0], -90)
    film = {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}}
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": _DEPTH},
        "sensor": {
            "type": "orthographic",
            "to_world": view @ mi.ScalarTransform4f().scale([half, half, 1.0]),
            "film": film,
        },
        "light": environment,
        "shape": {"type": "sphere", "to_world": upright, "bsdf": {"type": "diffuse"}},
    }
