"""Strategies against quadrature, on a plane that one direction sees."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import nacre
from nacre.analytic import Ggx
from nacre.mitsuba.environment import pixel_directions
from nacre_lab.sampling.direct import Product, Resampling, Separate, integrator
from nacre_lab.sampling.light_cells import LightCells

from .lights import lamps

pytest.importorskip("mitsuba", reason="needs the extra 'render'")

MATERIAL = Ggx(diffuse=(0.3, 0.2, 0.1), specular=(0.2, 0.3, 0.4), roughness=0.2)
VIEW = np.array([0.6, 0.0, 0.8])
WHOLE, PARTS = LightCells(lamps()), LightCells(lamps(), 24)
STRATEGIES = {
    "material": Separate(None),
    "light": Separate(WHOLE, material=False),
    "both": Separate(WHOLE),
    "one of the two": Product(WHOLE),
    "resampled": Resampling(WHOLE, 2),
    "product": Product(PARTS, 1, 3),
}
SLOW = {"material", "light", "both", "one of the two", "resampled"}


def reflected() -> np.ndarray:
    """Radiance that leaves a plane with the normal +z, by quadrature."""
    directions, solid_angle = pixel_directions(513, 1024)
    up = directions[..., 2] > 0.0
    solid_angle = np.broadcast_to(solid_angle[:, None], up.shape)[up]
    wi = directions[up]
    values = MATERIAL.eval(wi, VIEW) * lamps().radiance(wi) * (wi[:, 2] * solid_angle)[:, None]
    return np.asarray(values.sum(0))


@cache
def picture(name: str, paths: int = 512) -> np.ndarray:
    """Pixels of the plane, shape (n, 3)."""
    mi = nacre.mitsuba.mitsuba()
    bsdf = nacre.mitsuba.bsdf(MATERIAL)
    look = mi.ScalarTransform4f().look_at((4.0 * VIEW).tolist(), [0, 0, 0], [0, 1, 0])
    film = {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}}
    scene = mi.load_dict(
        {
            "type": "scene",
            "sensor": {"type": "orthographic", "to_world": look, "film": film},
            "plane": {
                "type": "rectangle",
                "to_world": mi.ScalarTransform4f().scale(9.0),
                "bsdf": bsdf,
            },
            "sky": {"type": "envmap", "bitmap": mi.Bitmap(lamps().pixels)},
        }
    )
    found = mi.render(scene, integrator=integrator(STRATEGIES[name], bsdf), spp=paths, seed=1)
    return np.array(found, np.float64).reshape(-1, 3)


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.slow] if n in SLOW else []) for n in STRATEGIES]
)
def test_each_strategy_finds_all_light_on_average(name):
    pixels = picture(name)
    error = pixels.std(0, ddof=1) / np.sqrt(len(pixels))
    assert (error < 0.02 * reflected()).all()
    # Bilinear light differs a little from that of the plugin between rows.
    assert (np.abs(pixels.mean(0) - reflected()) < 5.0 * error + 2e-3 * reflected()).all()


@pytest.mark.slow
def test_products_leave_less_noise():
    noise = {name: picture(name).std(0).mean() for name in ("material", "both", "product")}
    # The product takes four directions for each path, both takes two.
    assert noise["product"] < 0.85 * noise["both"] / np.sqrt(2.0)
    assert noise["both"] < noise["material"]
