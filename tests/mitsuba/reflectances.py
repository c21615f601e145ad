"""Reflectances and scenes that the rendering tests share."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np

import nacre
from nacre.array import Components
from nacre.brdf import Brdf
from nacre.geometry import dot, half_vector
from nacre.measured.merl import tabulate
from nacre.neural.inputs import PAPER, input_count
from nacre.neural.nbrdf import HIDDEN, OUTPUTS, NeuralBrdf
from nacre.numerics.mlp import Layer
from nacre.sampling import BlinnPhongMixture
from tests.data import require_data


class Constant(Brdf):
    """A Lambertian reflectance of one color."""

    name = "constant"

    def __init__(self, *albedo: float) -> None:
        self.albedo = albedo * 3 if len(albedo) == 1 else albedo

    def eval_components(self, wi: Components, wo: Components) -> Components:
        red, green, blue = (a / math.pi + 0.0 * (wi[2] + wo[2]) for a in self.albedo)
        return red, green, blue


class Lobe(Brdf):
    """A Blinn-Phong density of half vectors made a reflectance: under white light, seen along the
    normal, it reflects all but what falls below the horizon.

    Parameters
    ----------
    exponent
        Of the cosine of the half vector.
    """

    def __init__(self, exponent: float) -> None:
        self.exponent = exponent

    def eval_components(self, wi: Components, wo: Components) -> Components:
        """See :class:`nacre.brdf.Brdf`."""
        h = half_vector(wi, wo)
        density = (self.exponent + 2.0) / (2.0 * math.pi) * abs(h[2]) ** self.exponent
        value = density * h[2] / (4.0 * dot(wo, h) * wi[2])
        return value, 0.5 * value, 0.0 * value


class Tilted(Constant):
    """Not reciprocal: brighter where the light is higher."""

    def eval_components(self, wi: Components, wo: Components) -> Components:
        red, green, blue = super().eval_components(wi, wo)
        return red * wi[2], green * wi[2], blue * wi[2]


def network(seed: int, specular: float = 0.5, exponent: float = 50.0, **options: Any) -> NeuralBrdf:
    """An NBRDF of random weights that is positive nearly everywhere."""
    random = np.random.default_rng(seed)
    count = input_count(options.get("inputs", PAPER), options.get("isotropic", True))
    sizes = (count, *HIDDEN, OUTPUTS)
    layers = [
        Layer(
            random.normal(0, (1.0 / rows) ** 0.5, (rows, columns)).astype(np.float32),
            random.uniform(0, 0.2, columns).astype(np.float32),
        )
        for rows, columns in itertools.pairwise(sizes)
    ]
    layers[-1] = Layer(0.2 * layers[-1].weights, layers[-1].biases + np.float32(0.3))
    return NeuralBrdf(layers, sampler=BlinnPhongMixture(specular, exponent), **options)


def sphere_scene(mi: Any, bsdf: Any, size: int = 16, **parts: Any) -> dict[str, Any]:
    """A sphere that fills the frame under a constant sky."""
    camera = mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])
    pixels = "luminance" if mi.is_monochromatic else "rgb"
    film = {"type": "hdrfilm", "width": size, "height": size, "pixel_format": pixels}
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 4},
        "sensor": {
            "type": "orthographic",
            "to_world": camera @ mi.ScalarTransform4f().scale([0.6, 0.6, 1]),
            "film": film | {"rfilter": {"type": "box"}},
        },
        "sphere": {"type": "sphere", "bsdf": bsdf},
        "sky": {"type": "constant"},
        **parts,
    }


def interaction(mi: Any, wo: Any) -> Any:
    """A surface interaction seen from `wo`, NumPy vectors of shape (n, 3)."""
    import drjit as dr

    si = dr.zeros(mi.SurfaceInteraction3f, len(wo))
    si.wi = mi.Vector3f(np.ascontiguousarray(wo.T))
    return si


PUBLISHED = ("satin_rosaline", "paper_white", "cc_ibiza_sunset")


ENHANCED: dict[str, Any] = {"inputs": "enhanced", "activation": "squared relu"}
TURNED: dict[str, Any] = {**ENHANCED, "isotropic": False, "angle": 0.5}


def reflectance(name: str) -> Brdf:
    """A reflectance of the test, of the published networks or of the measured tables."""
    if name == "constant":
        return Constant(0.2, 0.5, 0.8)
    if name == "anisotropic":
        return network(3, isotropic=False)
    if name == "enhanced":
        return network(4, **ENHANCED)
    if name == "turned":
        return network(5, **TURNED)
    if name in RECIPROCAL:
        squared = {"inputs": "reciprocal", "activation": "squared relu"}
        return network(6, isotropic=name == "reciprocal", **squared)
    if name.startswith("random"):
        return network(int(name[len("random") :]))
    if name.endswith("tabulated"):
        return tabulate(reflectance(name.removesuffix(" tabulated")))
    folder, ending = ("rgl", "bsdf") if name.endswith("measured") else ("pretrained/rgl", "h5")
    return nacre.load(require_data(folder, f"{name.removesuffix(' measured')}_rgb.{ending}"))


RECIPROCAL = "reciprocal", "anisotropic reciprocal"
NAMES = (
    "constant",
    "anisotropic",
    "enhanced",
    "turned",
    *RECIPROCAL,
    "random1",
    *PUBLISHED,
    "satin_rosaline measured",
)
