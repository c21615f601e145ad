"""Samplers as JSON, for the headers of files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from nacre.brdf import CosineSampler, Sampler
from nacre.sampling.lobes import BlinnPhongMixture
from nacre.sampling.mixture import GgxLobe, GgxMixture, Values

COSINE, BLINN_PHONG, GGX = "cosine", "cosine + Blinn-Phong", "diffuse + GGX"


def describe_sampler(sampler: Sampler) -> dict[str, Any]:
    """Numbers of a sampler and its kind.

    Raises
    ------
    ValueError
        If it is of no kind that can be stored.
    """
    if isinstance(sampler, CosineSampler):
        return {"kind": COSINE}
    if isinstance(sampler, BlinnPhongMixture):
        return {"kind": BLINN_PHONG, **asdict(sampler)}
    if isinstance(sampler, GgxMixture):
        return {"kind": GGX, **asdict(sampler)}
    raise ValueError(f"cannot hold a sampler of type {type(sampler).__name__}")


def make_sampler(header: Mapping[str, Any]) -> Sampler:
    """The sampler of a description; the inverse of :func:`describe_sampler`.

    Raises
    ------
    KeyError, TypeError, ValueError
        If something is missing, of the wrong type, or out of bounds.
    """
    kind = header["kind"]
    if kind == COSINE:
        return CosineSampler()
    if kind == BLINN_PHONG:
        return BlinnPhongMixture(float(header["specular"]), float(header["exponent"]))
    if kind == GGX:
        lobes = (
            GgxLobe(*(_values(lobe, name) for name in ("share", "roughness", "across", "shift")))
            for lobe in header["lobes"]
        )
        uniform, squared, cosines = (_values(header, n) for n in ("uniform", "squared", "cosines"))
        angle = None if header["angle"] is None else float(header["angle"])
        return GgxMixture(tuple(lobes), uniform, squared, cosines, angle)
    raise ValueError(f"unknown sampler {kind!r}; update nacre")


def _values(header: Mapping[str, Any], name: str) -> Values:
    return tuple(float(value) for value in header[name])
