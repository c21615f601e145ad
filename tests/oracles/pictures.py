"""A sphere of one material, by any tool that runs exports, and by Mitsuba."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.color import tone_map
from nacre.mitsuba.engine import mitsuba
from nacre.mitsuba.lights import DirectionalLight
from nacre.mitsuba.plugins import bsdf
from nacre.mitsuba.preview import render_scene
from nacre.mitsuba.scene import directional, path_traced
from nacre.mitsuba.sphere import MARGIN, frames, sphere_normals
from nacre.targets import TARGETS, identifier
from tests.oracles.runner import Runner

SIZE = 256
_POINTS = 4  # along an edge of a pixel


def executed(runner: Runner, brdf: Brdf, size: int = SIZE) -> Floats:
    """The sphere with the reflectance that a runner computes, linear RGB (size, size, 3)."""
    shifts = (np.arange(_POINTS) + 0.5) / _POINTS - 0.5
    grid = [sphere_normals(size, np.array([x, y])) for y in shifts for x in shifts]
    light = DirectionalLight()
    image = np.zeros((size * size, 3))
    places, given = [], []
    for normals, mask in grid:
        local = frames(normals[mask])
        wi, _, points = light.incident(local)
        places.append(np.flatnonzero(mask)[points])
        given.append((wi, local[points, :, 2]))
    wi, wo = (np.concatenate(part).astype(np.float32) for part in zip(*given, strict=True))
    name = identifier(brdf.name)
    f = runner.run(TARGETS[runner.target]().files(brdf, name), name, "eval", wi, wo)
    np.add.at(image, np.concatenate(places), f * wi[:, 2:] * (math.pi / len(grid)))
    return image.reshape(size, size, 3)


def rendered(
    brdf: Brdf, size: int = SIZE, spp: int = 256, light: Mapping[str, Any] | None = None
) -> Floats:
    """The sphere by Mitsuba, linear RGB (size, size, 3); under a directional light if None."""
    mi = mitsuba()
    transform = mi.ScalarTransform4f
    half = 1.0 / (1.0 - MARGIN)
    sensor = {
        "type": "orthographic",
        "to_world": transform().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0]).scale([half, half, 1]),
        "film": {
            "type": "hdrfilm",
            "width": size,
            "height": size,
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
    }
    upright = transform().rotate([1, 0, 0], -90.0)
    scene = {
        **path_traced(2, sensor),
        "light": light or directional(DirectionalLight.direction),
        "sphere": {"type": "sphere", "to_world": upright, "bsdf": bsdf(brdf)},
    }
    return render_scene(scene, spp)


def psnr(image: Floats, truth: Floats) -> float:
    """Peak signal-to-noise ratio of display values in dB."""
    return -10.0 * math.log10(float(np.mean((tone_map(image) - tone_map(truth)) ** 2)))
