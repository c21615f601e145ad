"""A map of codes on a textured plane, from few photographs with one lamp each.

A plane of 24 x 24 texels is a blend of three published networks by smooth masks. They are held out:
the basis and the plan know only the others, as in :mod:`lab.studies.ablations.few_samples`. Lamps
and cameras stand where the plan has its first pairs of directions, two edges of the plane away, so
each texel is seen from a direction of its own. Mitsuba's path integrator renders the photographs,
which get the noise of photons and of reading.

Each texel is known by itself from its few pixels: by a code, the posterior mean, and by a diffuse
and a GGX lobe that are fitted to them.

Errors are those of the plane under other lamps, seen by other cameras.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

import nacre
from lab.studies.ablations.few_samples import planned, random_pairs
from lab.studies.ablations.from_photographs import noisy
from lab.studies.study import Study, data, log, progress
from nacre import analytic
from nacre.array import Image
from nacre.brdf import Brdf
from nacre.latent import NeuralBasis
from nacre.measured.scattered import ScatteredBrdf
from nacre.metrics.metrics import image_errors
from nacre.mitsuba.engine import mitsuba
from nacre.mitsuba.plugins import bsdf, register
from nacre.numerics.direction_samples import DirectionSamples
from nacre.runtime.parallel import thread_map
from nacre.textures.capture.patterns import noise
from nacre_lab.reproduce.codes import CodeSettings, bases, split

COUNTS = 4, 8, 16
TEXELS = 24
"""Along an edge of the plane, whose length is 2."""
DISTANCE = 4.0
"""Of lamps and cameras from the middle of the plane."""
PIXELS, TRUE_SAMPLES = 256, 64
RELIT = 8
GAIN, STARTS = 32.0, 4
"""Of the fit of GGX: of the logarithm, and sets of parameters to start from."""
PLANES = 2

Directions = npt.NDArray[np.float64]


def masks(seed: int) -> npt.NDArray[np.float32]:
    """How much of three materials each texel is, shape (3, rows, columns); they add up to 1."""
    random = np.random.default_rng((seed, 14))
    fields = np.stack([noise(random, TEXELS, 3.0) for _ in range(3)])
    powers = np.exp(3.0 * fields)
    return np.asarray(powers / powers.sum(axis=0), np.float32)


def centers() -> Directions:
    """Places of texels on the plane, shape (rows, columns, 3)."""
    x = (np.arange(TEXELS) + 0.5) * 2.0 / TEXELS - 1.0
    return np.stack([*np.meshgrid(x, x), np.zeros((TEXELS, TEXELS))], axis=-1)


def towards(place: Directions) -> tuple[Directions, Directions]:
    """Unit directions from texels to a place, and squared distances."""
    offset = place - centers()
    squared = (offset**2).sum(axis=-1, keepdims=True)
    return offset / np.sqrt(squared), squared


class Plane:
    """The truth: three materials, blended."""

    def __init__(self, materials: Sequence[Brdf], parts: npt.NDArray[np.float32]) -> None:
        self._materials, self.parts = materials, parts

    def f_r(self, wi: Directions, wo: Directions) -> Image:
        """At directions of each texel, shape (rows, columns, 3)."""
        pair = [w.reshape(-1, 3).astype(np.float32) for w in (wi, wo)]
        values = np.stack([m.eval(*pair).reshape(wi.shape) for m in self._materials])
        return np.asarray((self.parts[..., None] * values).sum(axis=0), np.float32)

    def photograph(self, lamp: Directions, camera: Directions, seed: int) -> Image:
        """Values of f_r at the texels, from a picture by Mitsuba, with noise."""
        mi = mitsuba()
        one, two, three = (bsdf(material) for material in self._materials)
        second = self.parts[1] / np.maximum(self.parts[0] + self.parts[1], 1e-6)
        blend = _blend(self.parts[2], _blend(second, one, two), three)
        up = [0.0, 1.0, 0.0] if abs(camera[2]) < 0.999 * DISTANCE else [1.0, 0.0, 0.0]
        film = {"type": "hdrfilm", "width": PIXELS, "height": PIXELS, "rfilter": {"type": "box"}}
        scene = mi.load_dict(
            {
                "type": "scene",
                "integrator": {"type": "path", "max_depth": 2},
                "plane": {"type": "rectangle", "bsdf": blend},
                "lamp": {"type": "point", "position": lamp.tolist(), "intensity": DISTANCE**2},
                "camera": {
                    "type": "perspective",
                    "fov": 42.0,
                    "to_world": mi.ScalarTransform4f().look_at(camera.tolist(), [0, 0, 0], up),
                    "film": film,
                },
            }
        )
        image = np.array(mi.render(scene, spp=TRUE_SAMPLES, seed=seed))[..., :3]
        image = noisy(image, np.random.default_rng((seed, 15)))
        x, y, seen = _pixels(scene)
        wi, squared = towards(lamp)
        texel = ((np.stack([y, x])[:, seen] + 1.0) * 0.5 * TEXELS).astype(int)
        total = np.zeros((TEXELS, TEXELS, 4))
        values = np.concatenate([image.reshape(-1, 3)[seen], np.ones((seen.sum(), 1))], axis=1)
        np.add.at(total, tuple(texel), values)
        mean = total[..., :3] / total[..., 3:]
        return np.asarray(mean * squared / (DISTANCE**2 * wi[..., 2:]), np.float32)


def _blend(weight: npt.NDArray[np.float32], one: Any, other: Any) -> dict[str, Any]:
    texture = {
        "type": "bitmap",
        "bitmap": mitsuba().Bitmap(weight[..., None]),
        "filter_type": "nearest",
        "raw": True,
    }
    return {"type": "blendbsdf", "weight": texture, "one": one, "other": other}


def _pixels(scene: Any) -> tuple[Any, Any, Any]:
    """Where the middles of pixels lie on the plane: x, y, and whether they do."""
    mi = mitsuba()
    middle = (np.arange(PIXELS) + 0.5) / PIXELS
    columns, rows = (a.reshape(-1) for a in np.meshgrid(middle, middle))
    place = mi.Point2f(mi.Float(columns), mi.Float(rows))
    rays, _ = scene.sensors()[0].sample_ray(0.0, 0.5, place, mi.Point2f(0.5))
    found = scene.ray_intersect_preliminary(rays, coherent=True)
    hit = rays(found.t)
    return np.array(hit.x), np.array(hit.y), np.array(found.is_valid())


def ggx(samples: DirectionSamples) -> Brdf:
    """Fitted to the samples of a texel."""
    scattered = ScatteredBrdf(samples.wi, samples.wo, samples.rgb)
    return analytic.fit(scattered, analytic.MODELS["ggx"], gain=GAIN, starts=STARTS)


def by_codes(basis: NeuralBasis, samples: DirectionSamples) -> Brdf:
    """What the samples of a texel say of its code."""
    return basis.decode(basis.encode(samples))


def error(plane: Plane, found: Sequence[Brdf]) -> float:
    """Mean PSNR in dB under other lamps, seen by other cameras."""
    wi, wo = (DISTANCE * w.astype(np.float64) for w in random_pairs(RELIT, 16))
    errors = []
    for lamp, camera in zip(wi, wo, strict=True):
        light, squared = towards(lamp)
        view, _ = towards(camera)
        falloff = DISTANCE**2 * light[..., 2:] / squared
        pairs = zip(light.reshape(-1, 3), view.reshape(-1, 3), strict=True)
        own = plane.f_r(light, view)
        theirs = [
            material.eval(a[None].astype(np.float32), b[None].astype(np.float32))
            for material, (a, b) in zip(found, pairs, strict=True)
        ]
        other = np.concatenate(theirs).reshape(own.shape)
        errors.append(image_errors(falloff * own, falloff * other)[0].psnr)
    return float(np.mean(errors))


def main() -> None:
    """Print the table."""
    study = Study(__doc__, __file__)
    study.add_argument("--counts", type=int, nargs="*", default=COUNTS, help="photographs")
    options = study.options()
    register()
    settings = CodeSettings(seed=options.seed)
    settings = settings.quick() if options.quick else settings
    training, held_out = split(sorted(data("pretrained", "merl").glob("*.h5")), options.seed)
    basis = bases(training, ["neural"], settings, study.cache, progress)["neural"]
    assert isinstance(basis, NeuralBasis)
    plan = [DISTANCE * w.astype(np.float64) for w in planned(basis, max(options.counts))]
    methods = {"codes": partial(by_codes, basis), "GGX": ggx}
    order = np.random.default_rng((options.seed, 17)).permutation(len(held_out))
    rows = []
    for index in study.few(range(PLANES), 1):
        files = [held_out[i] for i in order[3 * index : 3 * index + 3]]
        plane = Plane([nacre.load(file) for file in files], masks(index))
        seen = [plane.photograph(a, b, i) for i, (a, b) in enumerate(zip(*plan, strict=True))]
        for count in options.counts:
            photographs = _of_texels(plan, seen[:count])
            cells = []
            for method in methods.values():
                psnr = error(plane, list(thread_map(method, photographs)))
                cells.append(f"{psnr:.1f} dB")
            rows.append((" + ".join(file.stem for file in files), str(count), *cells))
            log(*rows[-1])
    study.table(("plane", "photographs", *methods), rows, note="PSNR, relit.")


def _of_texels(plan: Sequence[Directions], seen: Sequence[Image]) -> list[DirectionSamples]:
    """What pictures say of each texel."""
    wi, wo = (
        np.stack([towards(place)[0] for place in side[: len(seen)]], axis=2).astype(np.float32)
        for side in plan
    )
    rgb = np.stack(seen, axis=2)
    arrays = (array.reshape(TEXELS**2, -1, 3) for array in (wi, wo, rgb))
    return [DirectionSamples(*texel) for texel in zip(*arrays, strict=True)]


if __name__ == "__main__":
    main()
