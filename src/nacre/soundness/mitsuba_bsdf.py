"""A BSDF of Mitsuba as a subject of checks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.errors import NacreError, require
from nacre.mitsuba import engine, llvm
from nacre.soundness.design import by_design
from nacre.soundness.python_object import across, moved
from nacre.soundness.result import NotApplicableError
from nacre.soundness.subject import Drawn, Evaluate, Slope, Subject
from nacre.soundness.variant import MAIN, VARIANTS, VariantBsdf, missing_variants

_STEP = 2e-3  # of differences in single precision, in radians or a parameter that is 0
_SHARE = 0.01  # of other parameters, by which they move


class MitsubaSubject(Subject):
    """A BSDF of Mitsuba.

    Parameters
    ----------
    bsdf
        Makes the BSDF in the variant that is set; or the BSDF itself, of the variant
        `llvm_ad_rgb`, which is then checked in that variant only.

    Raises
    ------
    NacreError
        If it reflects in single directions only, or not at all.
    MissingExtraError, LLVMError
        If Mitsuba cannot run here.
    """

    def __init__(self, bsdf: Any, name: str) -> None:
        llvm.prepare()
        require("mitsuba", "render")
        engine.check_llvm()
        self.name = name
        self._make = bsdf if callable(bsdf) else None
        self._main = VariantBsdf(MAIN, bsdf if callable(bsdf) else lambda: bsdf)
        self._mi, self._dr = self._main.mi, self._main.dr
        with self._main.set():
            if not isinstance(self._main.bsdf, self._mi.BSDF):
                raise NacreError(f"{name}: is not a BSDF of {MAIN}; make it in that variant")
            flags, kinds = self._mi.BSDFFlags, self._main.bsdf.flags()
            smooth = int(flags.DiffuseReflection) | int(flags.GlossyReflection)
            if not kinds & smooth:
                raise NacreError(f"{name}: reflects only in single directions, or not at all")
            brdf = getattr(self._main.bsdf, "brdf", None)  # of this package's plugins
            if isinstance(brdf, Brdf):
                self.by_design = by_design(brdf)
            self.isotropic = not kinds & int(flags.Anisotropic)

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        return self._main.eval(wi, wo)

    def sample(self, wo: Floats, u: Floats) -> Drawn:
        main, mi = self._main, self._mi
        with main.set():
            interaction = main.interaction(wo)
            first = mi.Float(np.ascontiguousarray(u[:, 0], np.float32))
            second = mi.Point2f(np.ascontiguousarray(u[:, 1:].T, np.float32))
            drawn, weight = main.bsdf.sample(mi.BSDFContext(), interaction, first, second)
            self._dr.eval(drawn.wo, drawn.pdf, drawn.sampled_type, weight)
            count = len(u)
            wi = np.broadcast_to(np.array(drawn.wo, float).T, (count, 3))
            pdf = np.broadcast_to(np.array(drawn.pdf, float), count)
            weights = np.broadcast_to(np.array(weight, float).T, (count, 3))
            mirrored = np.array(mi.has_flag(drawn.sampled_type, mi.BSDFFlags.Delta), bool)
        kept = (wi[:, 2] > 0.0) & ~np.broadcast_to(mirrored, count)
        # Some plugins say that they drew nothing by the weight alone.
        none = kept & (weights == 0.0).all(axis=1)
        if none.any():
            kept[none] = self.pdf(wi[none], wo[none]) > 0.0
        return Drawn(wi, np.where(kept, pdf, 0.0), weights)

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        main, mi = self._main, self._mi
        if not len(wi):
            return np.zeros(0)
        with main.set():
            found = main.bsdf.pdf(mi.BSDFContext(), main.interaction(wo), main.vector(wi))
            values = np.broadcast_to(np.array(found, float), len(wi))
        return np.where(wi[:, 2] > 0.0, values, 0.0)

    def slopes(self) -> Sequence[Slope]:
        with self._main.set():
            parameters = self._mi.traverse(self._main.bsdf)
            fixed = int(self._mi.ParamFlags.NonDifferentiable)
            names = []
            for name in list(parameters.keys()):
                with suppress(TypeError):  # some plugins list parameters that they do not have
                    followed = self._dr.is_diff_v(type(parameters[name]))
                    if followed and not int(parameters.flags(name)) & fixed:
                        names.append(name)
        found = [Slope("the direction to the light", _STEP, self._turned, self._turning)]
        return found + [self._parameter(parameters, name) for name in names]

    def _turned(self, wi: Floats, wo: Floats, step: float) -> Floats:
        return np.asarray(self.eval(moved(wi, step), wo).sum(axis=1))

    def _turning(self, wi: Floats, wo: Floats) -> Floats:
        main, mi, dr = self._main, self._mi, self._dr
        with main.set():
            step = mi.Float(0.0)
            dr.enable_grad(step)
            light = main.vector(wi) + step * main.vector(across(wi))
            value = main.bsdf.eval(mi.BSDFContext(), main.interaction(wo), light)
            return self._forward(step, dr.sum(value) / light.z)

    def _forward(self, step: Any, value: Any) -> Floats:
        dr = self._dr
        count = dr.width(value)
        if not dr.grad_enabled(value):
            return np.zeros(count)
        dr.forward(step)
        return np.broadcast_to(np.array(dr.grad(value), float), count)

    def _parameter(self, parameters: Any, name: str) -> Slope:
        main, mi, dr = self._main, self._mi, self._dr
        with main.set():
            first = type(parameters[name])(parameters[name])
            size = float(np.abs(np.array(first, float)).mean())

        def sums(wi: Floats, wo: Floats, step: Any) -> Any:
            parameters[name] = first + step
            parameters.update()
            light = main.vector(wi)
            value = main.bsdf.eval(mi.BSDFContext(), main.interaction(wo), light)
            return dr.sum(value) / light.z

        def restored() -> None:
            parameters[name] = first
            parameters.update()

        def value(wi: Floats, wo: Floats, step: float) -> Floats:
            with main.set():
                found = np.array(sums(wi, wo, step), float)
                restored()
            return found

        def derivative(wi: Floats, wo: Floats) -> Floats:
            with main.set():
                step = mi.Float(0.0)
                dr.enable_grad(step)
                found = self._forward(step, sums(wi, wo, step))
                restored()
            return found

        step = _SHARE * size if size > 0.0 else _STEP
        return Slope(f"the parameter {name}", step, value, derivative)

    def variants(self) -> Mapping[str, Evaluate]:
        if self._make is None:
            raise NotApplicableError("it was given as an object, which has one variant")
        missing = missing_variants()
        found: dict[str, Evaluate] = {}
        for variant in VARIANTS:
            if variant not in missing and variant != MAIN:
                with suppress(NacreError):  # some plugins are for RGB only
                    found[variant] = VariantBsdf(variant, self._make).eval
        return found

    def tolerance(self, variant: str) -> float:
        return 0.1 if "spectral" in variant else 0.01
