"""Mixtures of closures as spheres, by the GLSL that MaterialX generates of their graphs."""

from __future__ import annotations

import math

import numpy as np

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.color import tone_map
from nacre.mitsuba.lights import DirectionalLight
from nacre.mitsuba.sphere import SIZE, frames, sphere_normals
from nacre.targets import TARGETS
from tests.oracles.surface_shader import SurfaceShader


def psnr(image: Floats, truth: Floats) -> float:
    """Of display values over the sphere, dB."""
    inside = sphere_normals(SIZE)[1]
    squared = (tone_map(image[inside]) - tone_map(truth[inside])) ** 2
    return -10.0 * math.log10(float(squared.mean()))


def materialx(mixture: Brdf) -> Floats:
    """The sphere under the directional light, by the graph in GLSL."""
    document = TARGETS["materialx-closures"]().files(mixture, "mixture")["mixture.mtlx"]
    normals, inside = sphere_normals(SIZE)
    frame = frames(normals[inside])
    light = np.array(DirectionalLight.direction, np.float32)
    image = np.zeros((SIZE, SIZE, 3))
    reflected = SurfaceShader(document.decode()).radiance({}, light, frame[:, 2], frame[:, 0])
    lit = frame[:, 2] @ light > 0.0  # what the generator's own light does not ask
    image[inside] = np.where(lit[:, None], math.pi * reflected, 0.0)
    return image
