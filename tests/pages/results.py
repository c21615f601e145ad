"""What the Python of pages must have found: a function has a page's name, and gets what it left."""

from __future__ import annotations

from typing import Any

import numpy as np

_PAIRS = 2000


def gradients(names: dict[str, Any]) -> None:
    """The light is found, and trained weights are closer to the measurement."""
    import nacre

    found = names["normalize"](names["direction"], dim=0).tolist()
    np.testing.assert_allclose(found, [0.505, 0.303, 0.808], atol=5e-3)
    wi, wo = _pairs()
    truth = np.log1p(names["measured"].eval(wi, wo))
    tuned = nacre.load("satin_tuned.safetensors")
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


def _pairs() -> list[np.ndarray[Any, np.dtype[np.float32]]]:
    """Random directions above the horizon, uniform over solid angle."""
    random = np.random.default_rng(7)
    z, phi = random.random((2, 2, _PAIRS))
    radius = np.sqrt(1.0 - z * z)
    both = np.stack([radius * np.cos(2 * np.pi * phi), radius * np.sin(2 * np.pi * phi), z], -1)
    return list(np.float32(both))
