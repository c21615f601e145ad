"""Integrals over the hemisphere of lights: energy, and what a sampler reaches."""

from __future__ import annotations

import math

import numpy as np

from nacre.array import Floats
from nacre.soundness.directions import VIEWS, Plan, spread, stratified, views
from nacre.soundness.result import Outcome
from nacre.soundness.subject import Subject

_SETS = 16  # of points, whose spread gives the error bar
_POINTS = 6144  # in each
_SIGMAS = 5.0  # error bars that an integral may exceed its bound by
_EXACT = 5e-3  # that rounding may add to an albedo or a density
_MISSED = 2e-3  # share of the reflected light that a sampler may not reach


def energy(subject: Subject, plan: Plan) -> Outcome:
    """A white furnace: no more light is reflected than arrives, from five views.

    Albedos are integrals of f_r cos(theta_i) over stratified points that do not depend on the
    material's sampler. The size is the largest albedo of a channel less five of its standard
    errors.
    """
    sizes, texts = [], []
    for index, wo in enumerate(views()):
        value, error = _furnace(subject, plan, wo, index)
        lowest = value - _SIGMAS * error
        channel = int(lowest.argmax())
        sizes.append(float(lowest[channel]))
        texts.append(f"{value[channel]:.4g} ± {error[channel]:.1g} at {VIEWS[index]:g}")
    worst = int(np.argmax(sizes))
    found = f"Albedo {', '.join(texts)} degrees."
    wo = np.stack(views())
    excess = np.maximum(np.array(sizes) - 1.0 - _EXACT, 0.0)
    return Outcome(sizes[worst], 1.0 + _EXACT, found, wo, wo, excess)


def _furnace(subject: Subject, plan: Plan, wo: Floats, index: int) -> tuple[Floats, Floats]:
    """Albedos of a view and their standard errors, shape (channels,)."""
    sets = [stratified(plan.random(6, index, each), _POINTS) for each in range(_SETS)]
    wi, density = spread(wo, np.concatenate(sets))
    weight = np.where(density > 0.0, wi[:, 2] / np.maximum(density, 1e-30), 0.0)
    seen = weight > 0.0
    found = subject.eval(wi[seen], np.broadcast_to(wo, wi[seen].shape))
    values = np.zeros((len(wi), found.shape[1]))
    values[seen] = np.nan_to_num(found, posinf=0.0, neginf=0.0) * weight[seen, None]
    means = values.reshape(_SETS, -1, values.shape[1]).mean(axis=1)
    return means.mean(axis=0), means.std(axis=0, ddof=1) / math.sqrt(_SETS)


def coverage(subject: Subject, plan: Plan) -> Outcome:
    """The sampler can draw every direction that reflects light.

    The size is the largest share of the light, at one of five views, that comes from directions
    whose density is 0.
    """
    sizes, lights, shown = [], [], []
    for index, wo in enumerate(views()):
        wi, density = spread(wo, stratified(plan.random(7, index), 2 * _POINTS))
        seen = (density > 0.0) & (wi[:, 2] > 1e-6)
        wi, view = wi[seen], np.broadcast_to(wo, wi[seen].shape)
        pdf = subject.pdf(wi, view)
        f = np.nan_to_num(subject.eval(wi, view)).sum(axis=1)
        light = np.maximum(f, 0.0) * wi[:, 2] / density[seen]
        missed = light * (pdf <= 0.0)
        total = float(light.sum())
        sizes.append(float(missed.sum()) / total if total > 0.0 else 0.0)
        lights.append(wi)
        shown.append(missed / total if total > 0.0 else missed)
    worst = int(np.argmax(sizes))
    found = "Every direction that reflects can be drawn."
    if sizes[worst] > _MISSED:
        found = (
            f"{sizes[worst]:.2%} of the light, viewed at {VIEWS[worst]:g} degrees, comes from "
            "directions that the sampler never draws."
        )
    wo = np.broadcast_to(views()[worst], lights[worst].shape)
    return Outcome(sizes[worst], _MISSED, found, lights[worst], wo, shown[worst])


def normalization(subject: Subject, plan: Plan) -> Outcome:
    """The density integrates to the share of samples that are drawn above the horizon.

    The size is the largest difference at one of five views, less five standard errors.
    """
    sizes, texts = [], []
    for index, wo in enumerate(views()):
        u = np.concatenate([stratified(plan.random(8, index, k), _POINTS) for k in range(_SETS)])
        wi, density = spread(wo, u)
        seen = density > 0.0
        values = np.zeros(len(wi))
        values[seen] = subject.pdf(wi[seen], np.broadcast_to(wo, wi[seen].shape)) / density[seen]
        means = np.nan_to_num(values).reshape(_SETS, -1).mean(axis=1)
        count = plan.samples // 4
        u = plan.random(9, index).random((count, 3))
        drawn = subject.sample(np.broadcast_to(wo, u.shape), u)
        share = float((drawn.pdf > 0.0).mean())
        error = math.hypot(
            float(means.std(ddof=1)) / math.sqrt(_SETS), math.sqrt(share * (1.0 - share) / count)
        )
        whole = float(means.mean())
        sizes.append(max(abs(whole - share), whole - 1.0) - _SIGMAS * error)
        texts.append(f"{whole:.4g} for {share:.4g} drawn at {VIEWS[index]:g}")
    wo, size = np.stack(views()), max(sizes)
    found = f"The density integrates to {', '.join(texts)} degrees."
    return Outcome(max(size, 0.0), _EXACT, found, wo, wo, np.maximum(np.array(sizes), 0.0))
