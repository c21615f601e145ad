"""Pictures of exports show the sphere of previews."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from nacre.array import Weights
from nacre.mitsuba.lights import DirectionalLight
from nacre.mitsuba.sphere import render_sphere, smooth_edges
from tests.oracles.materials import material
from tests.oracles.pictures import executed, psnr, rendered
from tests.oracles.runner import Runner


class _NumPy(Runner):
    target, title = "glsl", "NumPy"

    def missing(self) -> None:
        return None

    def run(
        self, files: Mapping[str, bytes], name: str, function: str, a: Weights, b: Weights
    ) -> Weights:
        return material("ggx").eval(a, b)


def test_tools_and_mitsuba_show_the_same_sphere() -> None:
    brdf, light, size = material("ggx"), DirectionalLight(), 48
    image, _ = render_sphere(brdf, light, size)
    expected, _ = smooth_edges(image, brdf, light)
    np.testing.assert_allclose(executed(_NumPy(), brdf, size), expected, rtol=1e-3, atol=1e-4)
    assert psnr(rendered(brdf, size, 64), expected) > 40.0
