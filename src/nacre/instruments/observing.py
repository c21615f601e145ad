"""What an instrument sees of a material: its channels, their colors, and sums over apertures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from nacre.array import Doubles
from nacre.brdf import COLOR, Brdf
from nacre.errors import NacreError
from nacre.instruments.apertures import turned
from nacre.instruments.colors import Color
from nacre.instruments.illuminants import Illuminant, Observer, rgb_weights, spectral_weights
from nacre.instruments.mirror import Mirror
from nacre.instruments.pairs import Pairs


@dataclass(frozen=True)
class Signal:
    """A sum over pairs of directions.

    Parameters
    ----------
    channels
        The sum for each channel of the material, (k,).
    known
        Share of the pairs at which f_r is known, from 0 to 1, weighted as the sum for a white
        diffuse surface.
    """

    channels: Doubles
    known: float


class Specimen:
    """A material below an instrument.

    Its channels are the bands of its spectra where these make a color, else linear Rec. 709 RGB; a
    :class:`nacre.instruments.Mirror` has three equal ones.

    Parameters
    ----------
    material
        A reflectance, or a mirror where the instrument reads one.
    azimuth
        Azimuth of the plane of incidence in degrees, for anisotropic materials.
    color
        Whether a color is wanted; else one band stands for all.

    Raises
    ------
    NacreError
        If the bands of the material make no color, and it has several or a color is wanted.
    """

    def __init__(
        self, material: Brdf | Mirror, azimuth: float = 0.0, *, color: bool = True
    ) -> None:
        self.mirror = material if isinstance(material, Mirror) else None
        self._brdf = None if isinstance(material, Mirror) else material
        self._azimuth = azimuth
        self._bands: Doubles | None = None
        if self._brdf is None:
            return
        bands = list(dict.fromkeys(self._brdf.channels))
        if self._brdf.channels != COLOR and len(bands) == 1 and not color:
            return  # the three channels are this band
        if self._brdf.channels != COLOR:
            name = self._brdf.name or "this material"
            seen = ", ".join(bands)
            fix = "colors cannot be read of it" if color else "choose one of them"
            raise NacreError(f"{name}: its bands make no color ({seen}); {fix}")
        if self._brdf.wavelengths is not None:
            self._bands = np.asarray(self._brdf.wavelengths, np.float64)

    @property
    def spectral(self) -> bool:
        """Whether colors are integrals of spectra."""
        return self._bands is not None

    def sum(self, pairs: Pairs) -> Signal:
        """The sum of f_r over pairs of directions."""
        if self._brdf is None:
            return Signal(np.zeros(3), 1.0)
        wi, wo = (turned(w, self._azimuth) for w in (pairs.wi, pairs.wo))
        values = self._brdf.eval if self._bands is None else self._brdf.eval_spectral
        channels = pairs.weights @ np.asarray(values(wi, wo), np.float64)
        shares = np.abs(pairs.weights)
        known = float(shares @ self._brdf.valid(wi, wo) / shares.sum())
        return Signal(channels, round(known, 9))

    def color(self, signal: Signal, illuminant: Illuminant, observer: Observer) -> Color:
        """The color of a signal that is 1 per channel for the perfect white."""
        weights = self._weights(illuminant, observer)
        x, y, z = (signal.channels @ weights).tolist()
        white_x, white_y, white_z = weights.sum(axis=0).tolist()
        estimated = not self.spectral and (illuminant, observer) != ("D65", 2)
        white = white_x, white_y, white_z
        return Color((x, y, z), white, illuminant, observer, estimated)

    def luminous(self, signal: Signal) -> float:
        """A signal weighted by V(lambda): under illuminant C, as scales of gloss are (ISO 2813:
        2014), where spectra are known; else the luminance of RGB, which is that under D65.
        """
        weights = self._weights("C" if self.spectral else "D65", 2)[:, 1]
        return float(signal.channels @ weights) / 100.0

    def _weights(self, illuminant: Illuminant, observer: Observer) -> Doubles:
        if self._bands is None:
            return rgb_weights(illuminant, observer)
        return spectral_weights(self._bands, illuminant, observer)
