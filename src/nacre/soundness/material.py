"""A reflectance of nacre as a subject of checks."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from nacre.array import Floats
from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.soundness.design import by_design
from nacre.soundness.python_object import STEP, across, moved
from nacre.soundness.result import NotApplicableError
from nacre.soundness.subject import Drawn, Evaluate, Slope, Subject
from nacre.soundness.variant import VARIANTS, VariantBsdf, missing_variants


class BrdfSubject(Subject):
    """A reflectance with its sampler, and with derivatives where PyTorch can follow it."""

    def __init__(self, brdf: Brdf) -> None:
        self.brdf = brdf
        self.name = brdf.name or type(brdf).__name__
        self.isotropic = brdf.isotropic
        self.by_design = by_design(brdf)

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        return np.asarray(self.brdf.eval(wi, wo), float)

    def sample(self, wo: Floats, u: Floats) -> Drawn:
        wi, pdf = self.brdf.sample(wo, u)
        return Drawn(np.asarray(wi, float), np.asarray(pdf, float))

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        return np.asarray(self.brdf.pdf(wi, wo), float)

    def slopes(self) -> Sequence[Slope]:
        if not self.brdf.traceable:
            raise NotApplicableError("it takes NumPy arrays only, so has no derivatives")
        if importlib.util.find_spec("torch") is None:
            raise NotApplicableError("PyTorch, which derives it, is not installed")

        def value(wi: Floats, wo: Floats, step: float) -> Floats:
            return np.asarray(self.eval(moved(wi, step), wo).sum(axis=1))

        return [Slope("the direction to the light", STEP, value, self._derivative)]

    def _derivative(self, wi: Floats, wo: Floats) -> Floats:
        import torch

        light = torch.tensor(wi, requires_grad=True)
        self.brdf.eval(light, torch.tensor(wo)).sum().backward()
        return np.asarray((light.grad.numpy() * across(wi)).sum(axis=1))

    def variants(self) -> Mapping[str, Evaluate]:
        found: dict[str, Evaluate] = {"float32": self._single}
        if not self.brdf.traceable:
            return found
        if importlib.util.find_spec("torch") is not None:
            found["PyTorch"] = self._in_torch
        missing = missing_variants()
        for variant in VARIANTS:
            if variant not in missing:
                found[variant] = VariantBsdf(variant, self._plugin()).eval
        return found

    def tolerance(self, variant: str) -> float:
        return 0.05 if "spectral" in variant else 0.01

    def _single(self, wi: Floats, wo: Floats) -> Floats:
        return np.asarray(self.brdf.eval(wi.astype(np.float32), wo.astype(np.float32)), float)

    def _in_torch(self, wi: Floats, wo: Floats) -> Floats:
        import torch

        with torch.no_grad():
            values: Any = self.brdf.eval(torch.tensor(wi), torch.tensor(wo))
        return np.asarray(values.numpy(), float)

    def _plugin(self) -> Callable[[], object]:
        from nacre.mitsuba import bsdf

        def make() -> object:
            try:
                return bsdf(self.brdf)
            except NacreError as error:
                raise NotApplicableError(str(error)) from error

        return make
