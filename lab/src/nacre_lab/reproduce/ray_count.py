"""How many rays a path traces on average, as Mitsuba's integrator `path` traces it."""

from __future__ import annotations

from typing import Any

from nacre.errors import require
from nacre.mitsuba.engine import mitsuba

_ROULETTE_DEPTH, _MOST_LIKELY = (
    5,
    0.95,
)  # where Mitsuba begins to end paths at random, and its limit


def rays_per_path(scene: Any, depth: int, paths: int = 1 << 16, seed: int = 0) -> float:
    """Mean number of rays per path: from the camera, on to what a BSDF samples, and to lights.

    The scene is loaded, and its first camera is used. Paths have at most `depth` segments, like the
    integrator's `max_depth`; the mean is over `paths` of them, seeded by `seed`.
    """
    mi: Any = mitsuba()
    dr: Any = require("drjit", "render")
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, paths)
    ray, _ = scene.sensors()[0].sample_ray(
        0.0, sampler.next_1d(), sampler.next_2d(), sampler.next_2d()
    )
    active, throughput = dr.full(mi.Bool, True, paths), dr.ones(mi.Color3f, paths)
    context, rays = mi.BSDFContext(), 0
    for segment in range(depth):
        rays += dr.count(active)[0]
        hit = scene.ray_intersect(ray, active)
        active &= hit.is_valid()
        if segment + 1 == depth:
            break
        bsdf = hit.bsdf(ray)
        lit = active & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        light, _ = scene.sample_emitter_direction(hit, sampler.next_2d(), False, lit)
        rays += dr.count(lit & (light.pdf != 0.0))[0]
        sampled, weight = bsdf.sample(
            context, hit, sampler.next_1d(active), sampler.next_2d(active), active
        )
        throughput *= weight
        brightest = dr.max(throughput)
        active &= brightest != 0.0
        if segment + 1 >= _ROULETTE_DEPTH:
            kept = dr.minimum(brightest, _MOST_LIKELY)
            active &= sampler.next_1d() < kept
            throughput = dr.select(active, throughput / kept, throughput)
        ray = hit.spawn_ray(hit.to_world(sampled.wo))
        dr.eval(ray, active, throughput, sampler)
    return rays / paths
