"""Four exported materials in a page with three.js, and in Mitsuba: pictures, and how far apart.

Writes `three.png`, a screenshot of the page, and `mitsuba.png`, the same spheres under the same
light, each alone, so that both have light of the environment and of the lamp only.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from PIL import Image

import nacre
from lab.studies.study import Study, data, log
from nacre import Recipe
from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.color import srgb_to_linear, tone_map
from nacre.formats import load_brdf
from nacre.mitsuba import bsdf
from nacre.mitsuba.engine import mitsuba
from nacre.mitsuba.environment import Environment, load_environment
from nacre.mitsuba.lights import DirectionalLight
from nacre.mitsuba.preview import render_scene, write_image
from nacre.mitsuba.scene import camera, directional, path_traced
from nacre.targets import TARGETS, identifier
from tests.oracles.materials import material
from tests.oracles.runners import browser, three

STEP = 2.2
"""Distance of the spheres."""
EYE, ANGLE = (0.0, 0.0, 14.0), 12.0
"""Where the camera is, and its vertical angle in degrees; it looks at the origin."""
SIZE = 1120, 352


def materials() -> Mapping[str, Brdf]:
    """Two published networks, and fits of a measurement and of a brushed metal; by identifier."""
    published = ("gold-metallic-paint", "blue-acrylic")
    found = [load_brdf(data("pretrained", "merl", f"{name}.h5")) for name in published]
    measured = load_brdf(data("rgl", "cc_ibiza_sunset_rgb.bsdf"))
    found += [nacre.fit(measured, Recipe(epochs=20, samples=100_000)), material("anisotropic")]
    return {identifier(each.name): each for each in found}


def places(count: int) -> list[list[float]]:
    """Where the spheres are, from the left."""
    return [[STEP * (i - (count - 1) / 2.0), 0.0, 0.0] for i in range(count)]


def shown(
    brdfs: Mapping[str, Brdf],
    environment: Environment,
    renderer: str,
    samples: int,
    path: Path,
) -> Floats:
    """The page as linear values in [0, 1]; its picture stays at a path."""
    files = dict(three.page())
    for name, brdf in brdfs.items():
        files |= TARGETS["three"]().files(brdf, name)
    spheres = [
        {"module": f"/{name}.js", "position": place, "samples": samples}
        for name, place in zip(brdfs, places(len(brdfs)), strict=True)
    ]
    sun = {"type": "DirectionalLight", "position": DirectionalLight.direction, "intensity": math.pi}
    height, width, _ = environment.pixels.shape
    description = {
        "renderer": renderer,
        "size": SIZE,
        "camera": {"position": EYE, "target": [0, 0, 0], "angle": ANGLE},
        "spheres": spheres,
        "lights": [sun],
        "environment": {"width": width, "height": height},
    }
    given = {"environment": equirectangular(environment)}
    browser.compute(files, "scene.js", "show", description, given, size=SIZE, screenshot=path)
    return srgb_to_linear(np.asarray(Image.open(path).convert("RGB"), np.float64) / 255.0)


def equirectangular(environment: Environment) -> Floats:
    """RGBA values of a map as three.js lays it out, rows from the top."""
    height, width, _ = environment.pixels.shape
    theta = (np.arange(height) + 0.5)[:, None] * math.pi / height
    phi = 2.0 * math.pi * ((np.arange(width) + 0.5)[None, :] / width - 0.5)
    parts = np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)
    radiance = environment.radiance(np.stack(np.broadcast_arrays(*parts), axis=-1))
    return np.concatenate([radiance, np.ones((height, width, 1))], axis=-1)


def rendered(brdf: Brdf, place: list[float], environment: Environment, spp: int) -> Floats:
    """A sphere alone, in the whole picture: linear values."""
    mi = mitsuba()
    move = mi.ScalarTransform4f().translate(place).rotate([1, 0, 0], -90.0)
    sensor = camera(EYE, (0.0, 0.0, 0.0), ANGLE, SIZE, "y")
    sensor["film"]["rfilter"] = {"type": "box"}
    scene = {
        **path_traced(2, sensor),
        "environment": {"type": "envmap", "bitmap": mi.Bitmap(environment.pixels)},
        "sun": directional(DirectionalLight.direction),
        "sphere": {"type": "sphere", "to_world": move, "bsdf": bsdf(brdf)},
    }
    return render_scene(scene, spp).astype(np.float64)


def covered(place: list[float], margin: float) -> Floats:
    """Which pixels see a sphere at this place, but for a margin of its radius."""
    width, height = SIZE
    scale = math.tan(math.radians(ANGLE) / 2.0)
    x = ((np.arange(width) + 0.5) / width * 2.0 - 1.0) * scale * width / height
    y = (1.0 - (np.arange(height) + 0.5) / height * 2.0) * scale
    ray = np.stack([*np.meshgrid(x, y), -np.ones((height, width))], axis=-1)
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    to = np.array(place) - EYE
    return np.linalg.norm(np.cross(ray, to), axis=-1) < 1.0 - margin


def main() -> None:
    """Make the pictures and the table."""
    study = Study(__doc__, __file__)
    study.add_argument("--renderer", choices=("webgl", "webgpu"), default="webgl")
    study.add_argument("--samples", type=int, default=64, help="of the environment (default: 64)")
    options = study.options()
    environment = load_environment(data("environment", "museum.exr")).exposed()
    brdfs = materials()
    start = time.perf_counter()
    found = shown(brdfs, environment, options.renderer, options.samples, study.output / "three.png")
    log(f"the page took {time.perf_counter() - start:.1f} s")
    picture = np.zeros((SIZE[1], SIZE[0], 3))
    rows = []
    for (name, brdf), place in zip(brdfs.items(), places(len(brdfs)), strict=True):
        alone = rendered(brdf, place, environment, 16 if options.quick else 256)
        picture = np.where(covered(place, 0.0)[..., None], alone, picture)
        inside = covered(place, 0.02)
        mean = np.square(tone_map(found) - tone_map(alone))[inside].mean()
        rows.append((name, f"{-10.0 * math.log10(mean):.1f}"))
    write_image(picture, study.output / "mitsuba.png")
    study.table(("material", "PSNR in dB"), rows)


if __name__ == "__main__":
    main()
