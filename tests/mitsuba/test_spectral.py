"""Spectral networks in Mitsuba's variants."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import nacre.mitsuba
from nacre.errors import NacreError
from tests.spectra import BANDS, pairs, spectral_network

from .reflectances import interaction, sphere_scene

WAVELENGTHS = np.array([[365.0, 400.0, 461.0, 699.0], [402.0, 550.0, 640.0, 820.0]], np.float32)


def evaluated(mi: Any, network: Any, wi: Any, wo: Any, wavelengths: Any) -> Any:
    """f_r times the cosine at four wavelengths for each pair, (4, n)."""
    si = interaction(mi, wo)
    kind = mi.UnpolarizedSpectrum if mi.is_polarized else mi.Spectrum
    si.wavelengths = kind(*[mi.Float(row) for row in wavelengths])
    light = mi.Vector3f(np.ascontiguousarray(wi.T))
    value = nacre.mitsuba.bsdf(network).eval(mi.BSDFContext(), si, light)
    return np.array(value[0, 0] if mi.is_polarized else value)


def expected(network: Any, wi: Any, wo: Any, wavelengths: Any) -> Any:
    spectra = network.eval_spectral(np.float64(wi), np.float64(wo))
    values = [
        [
            np.interp(w, network.wavelengths, spectrum)
            for w, spectrum in zip(row, spectra, strict=True)
        ]
        for row in wavelengths
    ]
    return np.array(values) * wi[:, 2]


@pytest.mark.parametrize("inputs", ["enhanced", "enhanced anisotropic"])
@pytest.mark.parametrize("bands", [BANDS, [532.0, 905.0], [550.0]])
def test01_spectra_are_those_of_numpy(spectral: Any, bands: Any, inputs: str) -> None:
    network = spectral_network(bands, inputs=inputs)
    wi, wo = pairs(400)
    wavelengths = np.random.default_rng(2).uniform(360, 830, (4, 400)).astype(np.float32)
    found = evaluated(spectral, network, wi, wo, wavelengths)
    np.testing.assert_allclose(found, expected(network, wi, wo, wavelengths), rtol=1e-3, atol=1e-5)


def test02_weight_of_a_sample_is_its_spectrum_over_its_density(spectral: Any) -> None:
    mi, network = spectral, spectral_network()
    (_, wo), u = pairs(400), np.random.default_rng(0).random((3, 400)).astype(np.float32)
    si = interaction(mi, wo)
    wavelengths = np.tile(WAVELENGTHS.reshape(8, 1)[:4], 400)
    si.wavelengths = mi.Spectrum(*[mi.Float(row) for row in wavelengths])
    bsdf = nacre.mitsuba.bsdf(network)
    sample, weight = bsdf.sample(mi.BSDFContext(), si, mi.Float(u[0]), mi.Point2f(u[1:]))
    wi, density = np.array(sample.wo).T, np.array(sample.pdf)
    drawn = density > 0
    truth = expected(network, wi[drawn], wo[drawn], wavelengths[:, drawn])
    found = np.array(weight)[:, drawn] * density[drawn]
    np.testing.assert_allclose(found, truth, rtol=2e-3, atol=1e-4)


def test03_a_picture_has_the_color_that_the_spectrum_has(spectral: Any) -> None:
    mi = spectral
    network = spectral_network()
    sky = {"type": "constant", "radiance": {"type": "d65"}}
    by_wavelength = mi.load_dict(sphere_scene(mi, nacre.mitsuba.bsdf(network), sky=sky))
    found = np.array(mi.render(by_wavelength, spp=1024, seed=1)).mean((0, 1))
    mi.set_variant("llvm_ad_rgb")
    in_color = mi.load_dict(sphere_scene(mi, nacre.mitsuba.bsdf(network)))
    color = np.array(mi.render(in_color, spp=512, seed=1)).mean((0, 1))
    np.testing.assert_allclose(found, color, rtol=0.02)


def test04_cooperative_weights_are_refused(rgb: Any) -> None:
    with pytest.raises(NacreError, match="or spectra"):
        nacre.mitsuba.bsdf(spectral_network(), weights="cooperative")
