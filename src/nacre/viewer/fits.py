"""What the page needs to fit networks itself: the compiled kernel, and the recipes of `nacre fit`.

The kernel's sources, in `kernel/`, are C for WebAssembly with SIMD; `make kernel` compiles them.
The page has the reflectance evaluated by the shaders that draw it, so whatever it shows can be
fitted.
"""

from __future__ import annotations

from dataclasses import asdict
from importlib import resources
from typing import Any

from nacre.neural.fit_data import ANISOTROPIC_FACTOR, SAMPLES
from nacre.neural.recipe import Recipe
from nacre.neural.scattered import SCATTERED_SAMPLES

PRESETS = "draft", "standard"
"""Those that a page offers; the others take minutes there."""


def kernel() -> bytes:
    """The compiled kernel."""
    return (resources.files(__package__) / "kernel" / "kernel.wasm").read_bytes()


def facts(part: str) -> dict[str, Any]:
    """What `fit.js` reads; `part` is the name of the kernel in the page."""
    presets = {name: _settled(Recipe.preset(name)) for name in PRESETS}
    counts = {"samples": SAMPLES, "factor": ANISOTROPIC_FACTOR, "scattered": SCATTERED_SAMPLES}
    return {"kernel": part, "presets": presets, **counts}


def _settled(recipe: Recipe) -> dict[str, Any]:
    """A recipe that leaves only the number of samples open, as the metadata of a fit has it."""
    return asdict(recipe) | {
        "inputs": recipe.chosen_inputs,
        "gain": recipe.loss_gain,
        "precision": recipe.stored_precision,
        "activation": recipe.hidden_activation,
    }
