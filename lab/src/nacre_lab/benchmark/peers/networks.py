"""Networks with physical laws or losses of other papers; PyTorch is imported when one is fitted."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any

from nacre.brdf import Brdf
from nacre.neural import Recipe
from nacre_lab.reproduce.trial import Method, Settings

LARGE = "pbnbrdf-4803"
"""Name of the network that takes minutes."""
FREQUENCY = 1e-3
"""Factor of the loss in frequency, the best of those tried on a MERL network; 0.1 in the paper,
which adds it to absolute errors."""

_STEPS = 20  # of an antiderivative, for each epoch of nacre's networks
_EPOCHS = 0.08  # of the others, each of larger batches
_BATCH = 1024
_ABSOLUTE = 1e-3  # gain at which log(1 + gain f cos) is as good as linear
_LAWS = {"chromaticity": 0.3, "passivity": 10.0, "ceiling": 0.97}


def networks(settings: Settings) -> dict[str, Method]:
    """The methods by name."""
    recipe = Recipe(
        batch=_BATCH,
        epochs=max(1, round(_EPOCHS * settings.epochs)),
        samples=settings.samples,
        seed=settings.seed,
    )
    return {
        "pbnbrdf-675": _antiderivative(settings, (21, 21)),
        LARGE: _antiderivative(settings, (64, 64)),
        "pbnbrdf-quadrature-675": _quadrature(replace(recipe, physical=True)),
        "frequency-675": _frequency("nacre's loss and FreNBRDF's", recipe, FREQUENCY),
        "frequency-675-paper": _frequency(
            "absolute errors and FreNBRDF's loss", recipe, 0.1, gain=_ABSOLUTE
        ),
        "frequency-675-off": _frequency("the same training with nacre's loss only", recipe, 0.0),
    }


def _antiderivative(settings: Settings, hidden: tuple[int, int]) -> Method:
    options: dict[str, Any] = {
        "hidden": hidden,
        "steps": _STEPS * settings.epochs,
        "samples": settings.samples or 200_000,
        "seed": settings.seed,
    }

    def fit(brdf: Brdf) -> Brdf:
        from nacre_lab.benchmark.peers.antiderivative import Training, fit_antiderivative

        return fit_antiderivative(brdf, Training(**options))

    about = "PBNBRDF's laws, own construction: derivative of a network, integral analytic"
    return Method(about, fit, "network", options)


def _quadrature(recipe: Recipe) -> Method:
    def fit(brdf: Brdf) -> Brdf:
        from nacre_lab.benchmark.peers.quadrature import fit_quadrature

        return fit_quadrature(brdf, recipe, **_LAWS)

    about = "PBNBRDF's laws and losses on a network of the usual kind, integral by quadrature"
    return Method(about, fit, "network", {"recipe": asdict(recipe), **_LAWS})


def _frequency(about: str, recipe: Recipe, weight: float, gain: float | None = None) -> Method:
    recipe = replace(recipe, gain=gain)
    factor = weight * (gain or 1.0)

    def fit(brdf: Brdf) -> Brdf:
        from nacre_lab.benchmark.peers.frequency import fit_frequency

        return fit_frequency(brdf, recipe, factor)

    return Method(about, fit, "network", {"recipe": asdict(recipe), "weight": factor})
