"""Table 3: how long pictures take, by representation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from nacre.render import bsdf
from nacre.render.engine import mitsuba
from nacre.render.scene import describe_scene
from nacre.render.throughput import race
from nacre.reproduce.study import Study
from nacre.runtime.progress import Progress, named

FIGURES = ("seconds a million paths", "time relative to GGX")

_GGX = "Mitsuba's roughconductor"
_ROUNDS, _SPP = 5, 64


def with_times(study: Study, methods: Sequence[str], progress: Progress) -> Study:
    """The same trials with times of rendering in place of their figures.

    The ball of `nacre render` is path traced, twice as wide as the study's spheres; all methods of
    a material take turns with Mitsuba's own GGX, `roughconductor`. Each representation is sampled
    by its own sampler.
    """
    mi = mitsuba()
    size = 2 * study.settings.size
    paths = size * size * _SPP / 1e6
    trials = {}
    for material in study.materials:
        found = [method for method in methods if (material, method) in study.trials]
        shown = {method: bsdf(study.fitted(material, method)) for method in found}
        shown[_GGX] = {"type": "roughconductor", "alpha": 0.2, "distribution": "ggx"}
        scenes = {
            name: mi.load_dict(describe_scene(one, size=(size, size)))
            for name, one in shown.items()
        }
        report = named(progress, material)
        results = race(scenes, _GGX, rounds=_ROUNDS, spp=_SPP, progress=report)
        for method in found:
            values = (results[method].seconds / paths, 1.0 / results[method].ratio)
            figures = dict(zip(FIGURES, values, strict=True))
            trials[material, method] = replace(study.trials[material, method], figures=figures)
    return replace(study, trials=trials)
