"""A sound material as a plain object, and ten that each have one fault."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from nacre.analytic import MODELS
from nacre.analytic.lambert import Lambert
from nacre.brdf import Brdf

GLOSSY = MODELS["ggx"](diffuse=(0.2, 0.3, 0.1), specular=(0.5, 0.5, 0.5), roughness=0.3)


class Plain:
    """What the interface of checks asks for, and nothing of nacre's own classes."""

    isotropic = True

    def __init__(self, brdf: Brdf = GLOSSY) -> None:
        self.brdf = brdf

    def eval(self, wi: Any, wo: Any) -> Any:
        return self.brdf.eval(wi, wo)

    def sample(self, wo: Any, u: Any) -> Any:
        wi, drawn = self.brdf.sample(wo, u)
        pdf = np.where(drawn > 0.0, self.pdf(wi, wo), 0.0)
        with np.errstate(all="ignore"):
            weight = self.eval(wi, wo) * wi[:, 2:] / pdf[:, None]
        return wi, pdf, np.where((pdf > 0.0)[:, None], weight, 0.0)

    def pdf(self, wi: Any, wo: Any) -> Any:
        return self.brdf.pdf(wi, wo)

    def gradient(self, wi: Any, wo: Any) -> Any:
        def moved(axis: Any) -> Any:
            return self.eval(wi + 1e-6 * axis, wo) - self.eval(wi - 1e-6 * axis, wo)

        return np.stack([moved(axis).sum(axis=1) / 2e-6 for axis in np.eye(3)], axis=-1)

    def variants(self) -> dict[str, Callable[[Any, Any], Any]]:
        return {"single": lambda wi, wo: self.eval(wi.astype(np.float32), wo.astype(np.float32))}


class NotReciprocal(Plain):
    """The light's height counts, the viewer's does not."""

    def eval(self, wi: Any, wo: Any) -> Any:
        return super().eval(wi, wo) * (1.0 - 0.2 * wi[:, 2:] ** 2)


class TooBright(Plain):
    """Reflects 1.05 times the light."""

    def __init__(self) -> None:
        super().__init__(Lambert(diffuse=(1.05, 0.5, 0.5)))


class DensityOff(Plain):
    """Says three percent more than it draws."""

    def pdf(self, wi: Any, wo: Any) -> Any:
        return 1.03 * super().pdf(wi, wo)


class DensityTilted(Plain):
    """Off by up to three percent to either side, so that the integral is right."""

    def pdf(self, wi: Any, wo: Any) -> Any:
        return super().pdf(wi, wo) * (1.0 + 0.03 * np.sign(wi[:, 0]))


class LobeNotDrawn(Plain):
    """Draws nothing on one side of the plane x = 0, and says so."""

    def pdf(self, wi: Any, wo: Any) -> Any:
        return super().pdf(wi, wo) * (wi[:, 0] > -0.5)


class LobeForgotten(Plain):
    """Draws by the cosine, but the density has the highlight too."""

    def sample(self, wo: Any, u: Any) -> Any:
        wi, _ = Lambert(diffuse=(1.0, 1.0, 1.0)).sample(wo, u)
        return wi, self.pdf(wi, wo)


class NotANumber(Plain):
    """No number where the light grazes the surface."""

    def eval(self, wi: Any, wo: Any) -> Any:
        return np.where(wi[:, 2:] < 1e-4, math.nan, super().eval(wi, wo))


class Negative(Plain):
    """Below zero at one side of the highlight, by a little."""

    def eval(self, wi: Any, wo: Any) -> Any:
        return super().eval(wi, wo) - 0.2 * (wi * wo).sum(axis=1, keepdims=True) ** 8


class WrongVariant(Plain):
    """Three percent too bright in one way to evaluate it."""

    def variants(self) -> Any:
        return super().variants() | {"wrong": lambda wi, wo: 1.03 * self.eval(wi, wo)}


class WrongGradient(Plain):
    """Derivatives that forget a tenth."""

    def gradient(self, wi: Any, wo: Any) -> Any:
        return 0.9 * super().gradient(wi, wo)


class Asymmetric(Plain):
    """Claims to be isotropic, but is brighter along x."""

    def eval(self, wi: Any, wo: Any) -> Any:
        return super().eval(wi, wo) * (1.0 + 0.1 * wi[:, :1] * wo[:, :1])


class WithCosine(Plain):
    """f_r with the cosine of the light."""

    def eval(self, wi: Any, wo: Any) -> Any:
        return super().eval(wi, wo) * wi[:, 2:]


FAULTS: dict[str, tuple[Callable[[], Plain], str]] = {
    "not reciprocal": (NotReciprocal, "reciprocity"),
    "energy 1.05": (TooBright, "energy"),
    "density off by 3 %": (DensityOff, "normalization"),
    "density off by 3 % to either side": (DensityTilted, "chi-square"),
    "density of another sampler": (LobeForgotten, "chi-square"),
    "sampler that misses a lobe": (LobeNotDrawn, "coverage"),
    "NaN at grazing": (NotANumber, "finite"),
    "negative": (Negative, "positive"),
    "wrong in one variant": (WrongVariant, "variants"),
    "wrong gradient": (WrongGradient, "gradients"),
    "asymmetric in azimuth": (Asymmetric, "isotropy"),
    "rough GGX with the cosine": (WithCosine, "no-cosine"),
    "Lambert with the cosine": (
        lambda: WithCosine(Lambert(diffuse=(0.5, 0.4, 0.3))),
        "no-cosine",
    ),
}
"""A material with each fault, and the property that must find it."""
