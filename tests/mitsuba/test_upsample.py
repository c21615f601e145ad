"""RGB to spectra: the table, and what a spectral rendering makes of it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nacre.mitsuba
from nacre.color import primaries, upsample
from tests.variants import USUAL

from .reflectances import Constant, sphere_scene

WAVELENGTHS = np.arange(360.0, 831.0, 1.0, dtype=np.float32)


def test01_primaries_share_every_wavelength() -> None:
    spectra = np.stack(primaries(WAVELENGTHS))
    assert spectra.min() >= 0.0
    assert spectra.max() <= 1.0
    np.testing.assert_allclose(spectra.sum(0), 1.0, atol=1e-6)
    ends = np.stack(primaries(np.array([100.0, 2000.0], np.float32)))
    np.testing.assert_array_equal(ends, spectra[:, [0, -1]])


def test02_linear_above_one() -> None:
    colour = (3.0, 0.5, 20.0)
    expected = sum(c * p for c, p in zip(colour, primaries(WAVELENGTHS), strict=True))
    np.testing.assert_allclose(upsample(colour, WAVELENGTHS), expected, rtol=1e-6)
    np.testing.assert_allclose(upsample((7.0, 7.0, 7.0), WAVELENGTHS), 7.0, rtol=1e-6)


def test03_drjit_agrees(rgb: Any) -> None:
    found = np.array([np.array(p) for p in primaries(rgb.Float(WAVELENGTHS))])
    np.testing.assert_allclose(found, np.stack(primaries(WAVELENGTHS)), atol=1e-6)


@pytest.mark.parametrize("colour", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1), (0.2, 5.0, 0.7)])
def test04_d65_gives_the_color_back(spectral: Any, colour: tuple[float, ...]) -> None:
    mi = spectral
    si = mi.SurfaceInteraction3f()
    si.wavelengths = mi.Float(WAVELENGTHS)
    light = np.array(mi.load_dict({"type": "d65"}).eval(si))[0]
    observer = np.array(mi.cie1931_xyz(mi.Float(WAVELENGTHS)))
    weights = light * observer / (light * observer[1]).sum()
    xyz = (weights * upsample(colour, WAVELENGTHS)).sum(1)
    found = np.array(mi.xyz_to_srgb(mi.Color3f(xyz.tolist()))).ravel()
    np.testing.assert_allclose(found, colour, atol=3e-4 * max(colour))


def test05_spectral_rendering_has_the_color_of_rgb(spectral: Any) -> None:
    colour = (0.7, 0.3, 0.1)
    mi = spectral
    sky = {"type": "constant", "radiance": {"type": "d65"}}
    scene = mi.load_dict(sphere_scene(mi, nacre.mitsuba.bsdf(Constant(*colour)), sky=sky))
    # The mean over 16 x 16 pixels: the noise left is that of the sampled wavelengths.
    found = np.array(mi.render(scene, spp=2048, seed=1)).mean((0, 1))
    mi.set_variant(USUAL)
    scene = mi.load_dict(sphere_scene(mi, nacre.mitsuba.bsdf(Constant(*colour))))
    expected = np.array(mi.render(scene, spp=256, seed=1)).mean((0, 1))
    np.testing.assert_allclose(expected, colour, atol=3e-3)
    np.testing.assert_allclose(found, expected, atol=5e-3)
