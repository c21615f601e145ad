"""Time of a picture with a PyTorch module as BSDF, against `nbrdf` of the same size.

python -m lab.studies.speed.own_network
"""

from __future__ import annotations

import itertools
import statistics
import time

import numpy as np

import nacre
from nacre.errors import require
from nacre.mitsuba.functions import reflectance
from nacre.mitsuba.passes import wavefronts
from nacre.neural.chain import ChainBrdf
from nacre.neural.nbrdf import NeuralBrdf

SIZE, SAMPLES, ROUNDS = 256, 64, 9


def scene(bsdf: object) -> object:
    mi = nacre.mitsuba.mitsuba()
    look = mi.ScalarTransform4f().look_at([0, -4, 1], [0, 0, 0], [0, 0, 1])
    film = {"type": "hdrfilm", "width": SIZE, "height": SIZE}
    return mi.load_dict({
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 4},
        "ball": {"type": "sphere", "bsdf": bsdf},
        "sky": {"type": "constant"},
        "lamp": {"type": "directional", "direction": [-0.5, 1.0, -0.5]},
        "sensor": {"type": "perspective", "fov": 32, "to_world": look, "film": film},
    })  # fmt: skip


def main() -> None:
    nn = require("torch.nn", "torch")
    mi = nacre.mitsuba.mitsuba()
    truth = nacre.load("rgl:satin_rosaline")
    sizes = truth.sizes
    steps = []
    for count, width in itertools.pairwise(sizes):
        steps += [nn.Linear(count, width), nn.ReLU()]
    module = nn.Sequential(*steps[:-1], nn.Softplus())
    for inputs in ("directions", truth.inputs):
        given = {"inputs": inputs, "sampler": truth.sampler}
        made = reflectance(module, **given)
        # The same layers and inputs in nacre's own network.
        assert isinstance(made, ChainBrdf)
        own = NeuralBrdf(made.layers, inputs=truth.inputs, sampler=truth.sampler)
        for weights in ("literals", "cooperative"):
            scenes = [scene(nacre.mitsuba.bsdf(brdf, weights=weights)) for brdf in (own, made)]
            times: list[list[float]] = [[], []]
            for round_ in range(ROUNDS + 1):
                for index, each in enumerate(scenes):
                    began = time.perf_counter()
                    np.array(mi.render(each, spp=SAMPLES, seed=round_))
                    times[index].append(time.perf_counter() - began)
            nbrdf, chain = (statistics.median(found[1:]) for found in times)
            print(f"{inputs}, {weights}: nbrdf {nbrdf:.3f} s, module {chain:.3f} s, "
                  f"{chain / nbrdf:.2f} times")  # fmt: skip
    called = _called(module)
    with wavefronts():
        times = [[], []]
        scenes = [scene(nacre.mitsuba.bsdf(own)), scene(called)]
        for round_ in range(4):
            for index, each in enumerate(scenes):
                began = time.perf_counter()
                np.array(mi.render(each, spp=SAMPLES, seed=round_))
                times[index].append(time.perf_counter() - began)
    nbrdf, chain = (statistics.median(found[1:]) for found in times)
    print(f"called between kernels: nbrdf {nbrdf:.3f} s, module {chain:.3f} s")


def _called(module: object) -> object:
    from nacre.mitsuba.wrapped import WrappedBrdf, torch_function

    function, parameters = torch_function(module)
    return nacre.mitsuba.bsdf(WrappedBrdf(function, "torch", parameters=parameters))


if __name__ == "__main__":
    main()
