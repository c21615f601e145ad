"""Disney's principled BRDF against Mitsuba's plugin."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from nacre.standard.disney import AnisotropicDisney
from tests.measured.support import hemisphere
from tests.mitsuba.reflectances import interaction
from tests.variants import require_mitsuba


def random_values(seed: int) -> dict[str, Any]:
    random = np.random.default_rng(seed)
    values: dict[str, Any] = {
        p.name: tuple(random.random(3)) if p.color else float(random.uniform(p.low, p.high))
        for p in AnisotropicDisney.parameters
    }
    return values | {"roughness": 0.15 + 0.85 * values["roughness"]}


@pytest.mark.parametrize("seed", range(8))
def test_mitsuba_has_the_same(seed):
    mi = require_mitsuba()
    values = random_values(seed)
    color = {"type": "rgb", "value": list(values["base_color"])}
    plugin = mi.load_dict({"type": "principled", **values, "base_color": color})
    random = np.random.default_rng(seed)
    wi, wo = (hemisphere(random, 2000).astype(np.float32) for _ in range(2))
    light = mi.Vector3f(np.ascontiguousarray(wi.T))
    expected = np.array(plugin.eval(mi.BSDFContext(), interaction(mi, wo), light)).T
    found = AnisotropicDisney(**values).eval(wi.astype(np.float64), wo) * wi[:, 2:]
    np.testing.assert_allclose(found, expected, rtol=1e-3, atol=1e-6)
    assert np.median(np.abs(found / expected - 1.0)) < 1e-5
