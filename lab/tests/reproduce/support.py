"""A small study: two networks with random weights, two methods that are quick."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import nacre
from nacre.analytic import MODELS
from nacre.brdf import Brdf
from nacre.errors import NacreError
from nacre.neural import Layer, NeuralBrdf
from nacre_lab.reproduce.trial import Method, Settings
from tests.analytic.materials import EXAMPLES

SETTINGS = Settings(size=16, directions=16, epochs=1, samples=2000)


def write_materials(folder: Path) -> list[Path]:
    """Files of two glossy grays."""
    random = np.random.default_rng(0)
    paths = []
    for name in ("a", "b"):
        layers = [
            Layer(random.normal(0, 0.5, (6, 8)).astype(np.float32), np.zeros(8, np.float32)),
            Layer(random.normal(0, 0.1, (8, 3)).astype(np.float32), np.full(3, 0.2, np.float32)),
        ]
        paths.append(folder / f"{name}.safetensors")
        nacre.save(NeuralBrdf(layers), paths[-1])
    return paths


class Gray:
    """A method that counts its fits, refuses material "b" on request, and stops on request."""

    def __init__(self, refuse: bool = False, stop_after: int = 1000) -> None:
        self.fits = 0
        self.refuse, self.stop_after = refuse, stop_after

    def __call__(self, brdf: Brdf) -> Brdf:
        if self.fits == self.stop_after:
            raise KeyboardInterrupt
        if self.refuse and brdf.source["file"].startswith("b"):
            raise NacreError("not for b")
        self.fits += 1
        return MODELS["lambert"](diffuse=(0.5, 0.5, 0.5))


def small_methods(gray: Gray, albedo: float = 0.5) -> dict[str, Method]:
    """The truth, a gray, and tables in place of a network."""
    return {
        "truth": Method("itself", lambda brdf: brdf, "truth"),
        "gray": Method("gray", gray, "analytic", {"albedo": albedo}),
        "nbrdf-675": Method("tables", lambda brdf: EXAMPLES["npf"], "network"),
    }
