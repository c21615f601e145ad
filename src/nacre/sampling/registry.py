"""The registry of samplers, and samplers as JSON for the headers of files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from nacre.brdf import CosineSampler, Sampler
from nacre.registry import Registry
from nacre.sampling.lobes import BlinnPhongMixture, UniformSampler
from nacre.sampling.mixture import GgxMixture

SAMPLERS: Registry[type[Sampler]] = Registry(
    "nacre.samplers",
    "sampler",
    {
        kind.kind: f"{kind.__module__}:{kind.__name__}"
        for kind in (CosineSampler, UniformSampler, BlinnPhongMixture, GgxMixture)
    },
)
"""Every kind of sampler that files can hold, by its `kind`; packages add theirs by an entry point
in the group `nacre.samplers`."""


def describe_sampler(sampler: Sampler) -> dict[str, Any]:
    """The kind of a sampler and its parameters, as JSON holds them.

    Raises ValueError if its class is not in :data:`SAMPLERS`, so that the file could not be read.
    """
    if SAMPLERS.get(sampler.kind) is not type(sampler):
        raise ValueError(
            f"cannot hold a sampler of type {type(sampler).__name__}, which is not registered in "
            "nacre.sampling.SAMPLERS by its kind"
        )
    return sampler.describe()


def make_sampler(description: Mapping[str, Any]) -> Sampler:
    """The sampler of a description; the inverse of :func:`describe_sampler`.

    Raises KeyError, TypeError or ValueError if something is missing, of the wrong type, or out of
    bounds, NacreError if another package brings the sampler and does not load.
    """
    kind = description["kind"]
    if kind not in SAMPLERS:
        raise ValueError(
            f"unknown sampler {kind!r}; update nacre, or install the package that brings it"
        )
    return SAMPLERS[kind].from_description(description)
