"""What all Mitsuba BSDFs of this package share.

Directions are swapped here and nowhere else: Mitsuba's `si.wi`, which points to the viewer, is our
`wo`, and its `wo` is our `wi`. When Mitsuba traces paths from the light it is the other way round,
which matters for a measurement that is not reciprocal.
"""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from nacre.array import Components
from nacre.brdf import Sampler, above_horizon
from nacre.errors import FormatError, NacreError, require
from nacre.included import resolve
from nacre.mitsuba import adapter


@cache
def base_class(variant: str) -> Any:
    """The base class of all plugins, for the variant that is set.

    A subclass implements :meth:`prepare`, :meth:`at`, :meth:`f_r` and :meth:`describe`, and also
    :meth:`to_local` and :meth:`from_local` if its frame is not the shading frame.
    """
    mi: Any = require("mitsuba", "render")
    dr: Any = require("drjit", "render")

    class NacreBsdf(mi.BSDF):  # type: ignore[misc]
        wavefront = False
        """Whether evaluation costs far more than ray tracing (see `passes.wavefronts`)."""

        def __init__(self, properties: Any, *arguments: Any) -> None:
            extra = self.prepare(properties, *arguments)
            super().__init__(properties)  # must come last: renderings may call it from here on
            self.m_flags = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide | extra
            self.m_components = [self.m_flags]

        def prepare(self, properties: Any, *arguments: Any) -> Any:
            """Set up what rendering needs; returns flags beside those of glossy reflection."""
            raise NotImplementedError

        def at(self, si: Any, view: Components) -> tuple[Any, Sampler]:
            """What :meth:`f_r` needs at hits, and the sampler to use there."""
            raise NotImplementedError

        def f_r(self, state: Any, wi: Components, wo: Components) -> Components:
            """f_r in 1/sr on components of the variant."""
            raise NotImplementedError

        def describe(self) -> dict[str, Any]:
            """Facts that :meth:`to_string` shows."""
            raise NotImplementedError

        def to_local(self, si: Any, w: Any) -> Components:
            """From the shading frame to the material's frame."""
            x, y, z = adapter.components(*w)
            return x, y, z

        def from_local(self, si: Any, w: Components) -> Components:
            return w

        def value(self, ctx: Any, si: Any, state: Any, given: Any, other: Any, active: Any) -> Any:
            """Spectrum of f_r times the cosine of `other`."""
            follows_light = ctx.mode == mi.TransportMode.Importance
            wi, wo = (given, other) if follows_light else (other, given)
            return self.spectrum(si, state, wi, wo, other[2], active)

        def spectrum(
            self, si: Any, state: Any, wi: Components, wo: Components, cosine: Any, active: Any
        ) -> Any:
            """f_r times a cosine as the variant has spectra."""
            rgb = above_horizon(self.f_r(state, wi, wo), wi, wo)
            red, green, blue = (c * cosine for c in rgb)
            return adapter.spectrum(mi, (red, green, blue), si.wavelengths, active)

        def sample(
            self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True
        ) -> tuple[Any, Any]:
            if not ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0):
                return dr.zeros(mi.BSDFSample3f), mi.Spectrum(0.0)
            given = self.to_local(si, si.wi)
            u: Any = adapter.components(sample1, *sample2)
            with np.errstate(all="ignore"):
                state, sampler = self.at(si, given)
                other, density = sampler.sample_components(given, u)
                active = active & (given[2] > 0) & (other[2] > 0) & (density > 0)
                value = self.value(ctx, si, state, given, other, active)
                inverse = adapter.masked(mi, 1.0 / density, active)
            drawn = adapter.glossy_sample(mi, self.from_local(si, other), density, active)
            return drawn, value * inverse

        def above(self, si: Any, wo: Any, active: Any) -> tuple[Components, Components, Any]:
            """`si.wi` and `wo` in the material's frame, and where both are above the horizon."""
            given, other = self.to_local(si, si.wi), self.to_local(si, wo)
            return given, other, active & (given[2] > 0) & (other[2] > 0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> tuple[Any, Any]:
            if not ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0):
                return mi.Spectrum(0.0), mi.Float(0.0)
            given, other, active = self.above(si, wo, active)
            with np.errstate(all="ignore"):
                state, sampler = self.at(si, given)
                density = sampler.pdf_components(other, given)
                value = self.value(ctx, si, state, given, other, active)
            return value, adapter.masked(mi, density, active)

        # Tracing f_r or the density only to drop it would take time.
        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            if not ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0):
                return mi.Spectrum(0.0)
            given, other, active = self.above(si, wo, active)
            with np.errstate(all="ignore"):
                state, _ = self.at(si, given)
                return self.value(ctx, si, state, given, other, active)

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            if not ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0):
                return mi.Float(0.0)
            given, other, active = self.above(si, wo, active)
            with np.errstate(all="ignore"):
                _, sampler = self.at(si, given)
                density = sampler.pdf_components(other, given)
            return adapter.masked(mi, density, active)

        def to_string(self) -> str:
            lines = "".join(f"  {name} = {value},\n" for name, value in self.describe().items())
            return f"{type(self).__name__}[\n{lines}]"

    return NacreBsdf


def material_path(properties: Any) -> Path:
    """The file that the property `filename` names, or a material that comes with nacre.

    Relative paths start from the scene. Raises FormatError if the property or material is missing.
    """
    if "filename" not in properties:
        raise FormatError(f"{properties.plugin_name()}: give it the property 'filename'")
    return resolved(properties["filename"])


def resolved(filename: Any) -> Path:
    """The path at which Mitsuba finds a file that a scene names."""
    return resolve(str(require("mitsuba", "render").file_resolver().resolve(str(filename))))


def choice(properties: Any, name: str, choices: tuple[str, ...]) -> str:
    """A property that is one of some words, by default the first; otherwise raises NacreError."""
    value = str(properties.get(name, choices[0]))
    if value not in choices:
        raise NacreError(
            f"{properties.plugin_name()}: {name} is one of {', '.join(choices)}; got {value!r}"
        )
    return value


def number(properties: Any, name: str, default: float, minimum: float) -> float:
    """A property that is a finite number of at least `minimum`; otherwise raises NacreError."""
    try:
        value = float(properties.get(name, default))
    except (TypeError, ValueError):
        value = math.nan
    if not (math.isfinite(value) and value >= minimum):
        raise NacreError(
            f"{properties.plugin_name()}: {name} must be a number of {minimum:g} or more; got "
            f"{properties.get(name)}"
        )
    return value
