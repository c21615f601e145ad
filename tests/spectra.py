"""Materials by wavelength that tests of several parts share."""

from __future__ import annotations

import itertools

import numpy as np

from nacre.brdf import COLOR, Brdf
from nacre.geometry import half_vector, split
from nacre.measured import ScatteredBrdf
from nacre.neural.spectral import LAST, SpectralBrdf
from nacre.numerics.mlp import RELU, SQUARED_RELU, Layer
from nacre.spectra import as_channels, to_rgb

BANDS = np.linspace(400.0, 700.0, 16)


class Coated(Brdf):
    """A blue body under a highlight that reddens with the angle, in any bands."""

    def __init__(self, wavelengths=BANDS) -> None:
        super().__init__(name="coated")
        self.wavelengths = np.asarray(wavelengths, np.float64)
        self.channels = as_channels(np.eye(len(self.wavelengths)), self.wavelengths)[1]

    def eval_components(self, wi, wo):
        found = as_channels(self._spectra(wi, wo), self.wavelengths)[0].astype(np.result_type(*wi))
        return tuple(np.moveaxis(found, -1, 0))

    def eval_bands(self, wi, wo):
        return self._spectra(split(wi), split(wo))

    def _spectra(self, wi, wo):
        h = half_vector(wi, wo)
        lobe = np.exp(-20.0 * (1.0 - h[2]))[..., None]
        rim = (1.0 - (wi[0] * h[0] + wi[1] * h[1] + wi[2] * h[2]))[..., None]
        place = (self.wavelengths - 550.0) / 150.0
        return 0.1 * np.exp(-2.0 * (place + 0.6) ** 2) + lobe * (0.3 + rim * (1.0 + place))


def scanned(brdf: Brdf, count: int = 600, seed: int = 0) -> ScatteredBrdf:
    """A scan of a material at random directions up to 80 degrees."""
    w = np.random.default_rng(seed).normal(size=(2, 4 * count, 3))
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    w[..., 2] = np.abs(w[..., 2])
    wi, wo = w[:, (w[..., 2] > 0.17).all(axis=0)][:, :count]
    spectra = brdf.eval_spectral(wi, wo)
    rgb, channels = as_channels(spectra, brdf.wavelengths)
    scan = ScatteredBrdf(wi, wo, rgb, "coated", spectra=spectra, wavelengths=brdf.wavelengths)
    return scan.replaced(channels=channels)


def spectral_network(bands=BANDS, coefficients: int = 4, seed: int = 0, **options) -> SpectralBrdf:
    """A spectral network with random weights, none of whose bands is negative."""
    random = np.random.default_rng(seed)
    sizes = (8 if options.get("inputs") == "enhanced anisotropic" else 6, 12, coefficients)
    layers = [
        Layer(random.normal(size=(a, b)) / np.sqrt(a), 0.3 * random.random(b))
        for a, b in itertools.pairwise(sizes)
    ]
    bound = [Layer(-layers[-1].weights, 2.0 - layers[-1].biases)]
    # The bound keeps x from 0.05 on, so that e^x - 1 is positive.
    bound += [Layer(-np.eye(coefficients), np.full(coefficients, 2.0))]
    raised = Layer(np.eye(coefficients), np.full(coefficients, 0.05))
    activations = [SQUARED_RELU, RELU, RELU, LAST]
    spectra = 0.1 * random.random((coefficients, len(bands)))
    made = [*layers[:-1], *bound, raised]
    return SpectralBrdf(made, activations, spectra, bands, name="random", **options)


def color_of(brdf: Brdf, wi, wo):
    """The color of a material's spectra, in double precision."""
    assert brdf.channels == COLOR
    return to_rgb(brdf.eval_spectral(np.float64(wi), np.float64(wo)), brdf.wavelengths)


def pairs(count: int = 500, seed: int = 1):
    """Directions above the horizon, (count, 3) each, float32."""
    w = np.random.default_rng(seed).normal(size=(2, count, 3)).astype(np.float32)
    w /= np.linalg.norm(w, axis=-1, keepdims=True)
    w[..., 2] = np.abs(w[..., 2])
    return w
