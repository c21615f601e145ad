"""Steps of optimization through renderings, for :mod:`lab.studies.endurance`."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Any

import nacre


def _steps(key: str, rate: float, **properties: Any) -> Iterator[None]:
    """Steps of Adam through `prb`, until the picture is that of another material."""
    import drjit as dr

    mi = nacre.mitsuba.mitsuba()
    nacre.mitsuba.register()
    film = {"type": "hdrfilm", "width": 32, "height": 32, "rfilter": {"type": "box"}}
    place = mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])
    described = {
        "type": "scene",
        "integrator": {"type": "prb", "max_depth": 4},
        "sensor": {"type": "perspective", "to_world": place, "film": film},
        "sky": {"type": "constant"},
        "lamp": {"type": "point", "position": [2, 3, 4], "intensity": 20.0},
    }
    other = {"type": "nbrdf", "filename": "nbrdf-rgl:paper_red"}
    target = mi.render(
        mi.load_dict(described | {"ball": {"type": "sphere", "bsdf": other}}), spp=64
    )
    shown = {"type": "sphere", "bsdf": {"type": "nbrdf", **properties}}
    scene = mi.load_dict(described | {"ball": shown})
    parameters = mi.traverse(scene)
    name = next(each for each in parameters.keys() if each.endswith(key))  # noqa: SIM118
    optimizer = mi.ad.Adam(lr=rate, params={name: parameters[name]})
    for seed in itertools.count():
        parameters.update(optimizer)
        picture = mi.render(scene, parameters, spp=8, seed=seed)
        dr.backward(dr.mean(dr.square(picture - target), axis=None))
        optimizer.step()
        yield


def optimized_weights() -> Iterator[None]:
    """A step of optimizing a network's weights through renderings."""
    return _steps("weights", 2e-3, filename="nbrdf-rgl:paper_white", weights="cooperative")


def optimized_codes() -> Iterator[None]:
    """A step of optimizing a code through renderings."""
    return _steps("code", 2e-2, code=",".join(["0"] * 32))
