"""What the Python of pages must have found: a function has a page's name, and gets what it left."""

from __future__ import annotations

from typing import Any

import numpy as np


def gradients(names: dict[str, Any]) -> None:
    """The light is found, and trained weights are closer to the measurement at grazing views."""
    import nacre

    random = np.random.default_rng(7)
    found = names["normalize"](names["direction"], dim=0).tolist()
    np.testing.assert_allclose(found, [0.505, 0.303, 0.808], atol=5e-3)
    wi, wo = _directions(random), _directions(random)
    wo = wo[wo[:, 2] < 0.5]
    wi = wi[: len(wo)]
    truth = np.log1p(names["measured"].eval(wi, wo))
    tuned: Any = nacre.load("satin_tuned.safetensors")
    before, after = (
        np.abs(np.log1p(each.eval(wi, wo)) - truth).mean() for each in (names["satin"], tuned)
    )
    assert after < before


def codes(names: dict[str, Any]) -> None:
    """The code that was found is better than the best start, and decodes into a material."""
    misfit, starts, space = names["misfit"], names["starts"], names["space"]
    ends = starts[misfit(starts[:, None]).argmin()], names["code"]
    before, after = (float((misfit(code) - space.log_prior(code)).detach()) for code in ends)
    assert after < before
    assert names["material"].name == "satin"


def _directions(random: np.random.Generator) -> Any:
    """Directions above the horizon, uniform over solid angle."""
    z, turn = random.random((2, 2000))
    radius, phi = np.sqrt(1.0 - z * z), 2.0 * np.pi * turn
    return np.stack([radius * np.cos(phi), radius * np.sin(phi), z], -1).astype(np.float32)
