"""Reflectance known at scattered pairs of directions, as a gonioreflectometer measures it.

Any other is sampled on a grid in the Rusinkiewicz angles (Rusinkiewicz 1998, "A New Change of
Variables for Efficient BRDF Representation"), even in the coordinates of
:func:`nacre.measured.interpolation.coordinates`: dense near the mirror direction, and with fewer
azimuths where they matter less.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Array, Components, Floats
from nacre.brdf import COLOR, Brdf
from nacre.errors import NacreError
from nacre.geometry import from_rusinkiewicz_angles, join, split
from nacre.measured.interpolation import NEIGHBORS, Neighbours, SampleTree, interpolate, logarithms
from nacre.measured.sharpening import sharpened
from nacre.numerics.direction_samples import DirectionSamples, Scattered
from nacre.sampling import LobeSampledBrdf, check_isotropic
from nacre.spectra import chosen_channels, narrowed

_HALF, _DIFFERENCE, _AZIMUTHS = 60, 48, 20
"""Nodes of an isotropic grid in theta_h and theta_d; largest number of steps in phi_d to pi."""
_HALF_2, _DIFFERENCE_2, _AZIMUTHS_2 = 24, 18, 36
"""The same for an anisotropic one, over the full circle in phi_h and phi_d."""
_GRAZING = 1e-3  # smallest cosine of a direction


class ScatteredBrdf(LobeSampledBrdf):
    """A reflectance from samples at any pairs of directions.

    f_r is interpolated (:mod:`nacre.measured.interpolation`): a plane is fitted to log f_r of the
    16 nearest samples, weighted by the inverse square of their distance. The result is kept within
    the range of these neighbors, so it is bounded by the data everywhere, the horizon included, and
    passes through the samples, or, where apertures are known, through values whose means over
    the apertures they are (:mod:`nacre.measured.sharpening`). f_r counts as known where the nearest
    sample is no further away than samples typically are from each other. Nothing is assumed about
    exchanging the directions. Evaluation runs on NumPy arrays only.

    Parameters
    ----------
    wi, wo
        Directions to the light and to the viewer, shapes (n, 3), above the horizon; scaled to unit
        length.
    rgb
        f_r in 1/sr, linear Rec. 709 RGB, shape (n, 3). A negative channel is a color outside the
        gamut: it is kept, and counts as 0 in evaluation.
    isotropic, mirrored
        Whether turning both directions about the normal changes nothing, and whether mirroring both
        in a plane with the normal does not: samples then stand for phi_d and for -phi_d. The second
        is true for nearly every isotropic material, and ignored for others.
    spectra, wavelengths
        f_r in 1/sr per band, shape (n, bands), and the bands in nm, shape (bands,), where known.
    sigma
        Standard deviation of the noise of f_r in 1/sr, in every channel, shape (n,), where known.
    apertures
        Half the angles of the cones of source and detector in radians, shape (n, 2) or (2,), each
        below a right angle; 0 where there is none. See :mod:`nacre.sampling.apertures`.
    bandwidth
        Width of the bands at half their height in nm, where spectra are known; 0 for lines. See
        :func:`nacre.spectra.narrowed`.
    facts
        What else :meth:`describe` should show.

    Raises
    ------
    ValueError
        If shapes do not match, there is no sample, a value is not finite, a standard deviation or
        an aperture or the bandwidth is out of range, or a direction is not above the horizon;
        :func:`nacre.measured.deduplication.from_measurement` sorts such rows out.
    """

    traceable = False

    def __init__(
        self,
        wi: npt.ArrayLike,
        wo: npt.ArrayLike,
        rgb: npt.ArrayLike,
        name: str = "",
        *,
        isotropic: bool = True,
        mirrored: bool = True,
        spectra: npt.ArrayLike | None = None,
        wavelengths: npt.ArrayLike | None = None,
        sigma: npt.ArrayLike | None = None,
        apertures: npt.ArrayLike | None = None,
        bandwidth: float = 0.0,
        facts: Mapping[str, Any] | None = None,
    ) -> None:
        light, view, color = arrays = [np.array(a, np.float64) for a in (wi, wo, rgb)]
        for array in arrays:
            if array.ndim != 2 or array.shape != (len(color), 3):
                raise ValueError(f"expected shapes (n, 3), got {array.shape}")
        if not len(color):
            raise ValueError("expected at least one sample")
        if not all(np.isfinite(array).all() for array in arrays):
            raise ValueError("directions and values must be finite")
        if min(light[:, 2].min(), view[:, 2].min()) <= 0.0:
            raise ValueError("directions must be above the horizon")
        light, view = (w / np.linalg.norm(w, axis=1, keepdims=True) for w in (light, view))
        super().__init__(name=name)
        self.isotropic = isotropic
        self.mirrored = mirrored and isotropic
        self.spectra = None if spectra is None else np.array(spectra, np.float64)
        self.wavelengths = None if wavelengths is None else np.array(wavelengths, np.float64)
        if (self.spectra is None) != (self.wavelengths is None):
            raise ValueError("spectra and wavelengths come together")
        if self.spectra is not None and self.wavelengths is not None:
            expected = (len(color), *self.wavelengths.shape)
            if self.wavelengths.ndim != 1 or self.spectra.shape != expected:
                raise ValueError(f"spectra of shape {self.spectra.shape}, expected (n, bands)")
        noise = None if sigma is None else np.array(sigma, np.float64)
        if noise is not None and noise.shape != color.shape[:1]:
            raise ValueError(f"sigma of shape {noise.shape}, expected (n,)")
        if noise is not None and not (np.isfinite(noise) & (noise >= 0.0)).all():
            raise ValueError("sigma must be finite and not negative")
        cones = None if apertures is None else np.array(apertures, np.float64)
        if cones is not None:
            if cones.shape not in ((2,), (len(color), 2)):
                raise ValueError(f"apertures of shape {cones.shape}, expected (n, 2)")
            if not ((cones >= 0.0) & (cones < 0.5 * math.pi)).all():
                raise ValueError("apertures must be from 0 to less than 90 degrees")
            cones = np.tile(cones, (len(color), 1)) if cones.ndim == 1 else cones
            cones = cones if cones.any() else None
        self.samples = DirectionSamples(light, view, color, noise, cones)
        """Directions, linear RGB, noise and apertures as they were measured; float64."""
        if not 0.0 <= bandwidth < math.inf:
            raise ValueError(f"the bandwidth must be 0 or more, got {bandwidth}")
        self.bandwidth = bandwidth if self.spectra is not None else 0.0
        self._facts = dict(facts or {})

    def subset(self, chosen: npt.NDArray[Any]) -> ScatteredBrdf:
        """The reflectance from some of the samples alone, by their indices or a mask."""
        part = self.samples[chosen]
        return ScatteredBrdf(
            part.wi,
            part.wo,
            part.rgb,
            self.name,
            isotropic=self.isotropic,
            mirrored=self.mirrored,
            spectra=None if self.spectra is None else self.spectra[chosen],
            wavelengths=self.wavelengths,
            sigma=part.sigma,
            apertures=part.apertures,
            bandwidth=self.bandwidth,
        ).replaced(channels=self.channels, notes=self.notes)

    def scattered(self) -> Scattered:
        """The samples without apertures and bandwidth; see :meth:`nacre.Brdf.scattered`."""
        if self.samples.apertures is None and not self.bandwidth:
            return self
        samples, spectra = self._sharp
        return self._changed(samples=samples, spectra=spectra, bandwidth=0.0)

    def through(self, source: float, detector: float) -> ScatteredBrdf:
        """A copy that knows through which apertures it was measured.

        They are half the angles of the cones of source and detector, in degrees. Raises ValueError
        if one is not from 0 to less than 90.
        """
        degrees = np.array([source, detector], np.float64)
        if not ((degrees >= 0.0) & (degrees < 90.0)).all():
            raise ValueError(f"expected 0 to less than 90 degrees, got {source:g} and {detector:g}")
        apertures = np.tile(np.radians(degrees), (len(self.samples), 1)) if degrees.any() else None
        return self.with_samples(replace(self.samples, apertures=apertures))

    def in_bands(self, bands: Sequence[float] | str) -> Brdf:
        if self.spectra is None or self.wavelengths is None:
            return super().in_bands(bands)
        try:
            rgb, channels = chosen_channels(self.spectra, self.wavelengths, bands)
        except ValueError as error:
            raise NacreError(f"{self.name or 'this material'}: {error}") from error
        return self.with_samples(replace(self.samples, rgb=rgb)).replaced(channels=channels)

    def with_samples(self, samples: DirectionSamples) -> ScatteredBrdf:
        """A copy with other values at the same directions; spectra stay as they are."""
        return self._changed(samples=samples)

    def with_spectra(self, spectra: Floats, wavelengths: Floats) -> ScatteredBrdf:
        """A copy with other spectra, (n, bands), at wavelengths in nm; colors stay as they are."""
        return self._changed(spectra=spectra, wavelengths=wavelengths)

    def _changed(self, **attributes: Any) -> ScatteredBrdf:
        made = self.replaced(**attributes)
        for name in ("_sharp", "_logs", "_spectral_logs"):
            vars(made).pop(name, None)
        return made

    def nearest(self, wi: npt.ArrayLike, wo: npt.ArrayLike) -> npt.NDArray[np.int64]:
        """Index of the nearest sample to each pair of directions, shape (n,) for (n, 3)."""
        return self._tree.near(split(wi), split(wo), 1).sample[:, 0]

    @property
    def nbytes(self) -> int:
        colors = self.samples.rgb if self.spectra is None else self.spectra
        return self.samples.wi.nbytes + self.samples.wo.nbytes + colors.nbytes

    def eval_components(self, wi: Components, wo: Components) -> Components:
        """A NacreError refuses anything but NumPy arrays."""
        near, shape, dtype = self._near(wi, wo, NEIGHBORS)
        f = interpolate(near, self._logs).astype(dtype).reshape(*shape, 3)
        return f[..., 0], f[..., 1], f[..., 2]

    def eval_bands(self, wi: Floats, wo: Floats) -> Floats:
        if self._spectral_logs is None:
            return super().eval_bands(wi, wo)
        near = self._tree.near(split(wi), split(wo), NEIGHBORS)
        return interpolate(near, self._spectral_logs)

    def valid_components(self, wi: Components, wo: Components) -> Array:
        given, shape, _ = self._numbers(wi, wo)
        return self._tree.within_reach(*given).reshape(shape)

    def describe(self) -> dict[str, Any]:
        samples, bands = self.samples, self.wavelengths
        light, view = (math.degrees(math.acos(w[:, 2].min())) for w in (samples.wi, samples.wo))
        facts = {
            "samples": len(samples),
            "source half-angle": self._half_angle(0),
            "detector half-angle": self._half_angle(1),
            "bandwidth nm": self.bandwidth or None,
            "uncertainty": self._uncertainty(),
            "mirrored": self.mirrored,
            "interpolation": f"moving least squares of log f_r, {NEIGHBORS} neighbors",
            "steepest light": f"{light:.1f} degrees",
            "steepest view": f"{view:.1f} degrees",
            "value range": [float(samples.rgb.min()), float(samples.rgb.max())],
            "bands": None if bands is None else len(bands),
            "wavelengths nm": None if bands is None else [float(bands[0]), float(bands[-1])],
        }
        found = {name: value for name, value in facts.items() if value is not None}
        return super().describe() | found | self._facts

    def _half_angle(self, side: int) -> str | None:
        """Of the cone of the source or the detector, in words."""
        if self.samples.apertures is None:
            return None
        low, high = np.degrees([f(self.samples.apertures[:, side]) for f in (np.min, np.max)])
        angle = f"{high:.3g}" if high - low < 1e-6 else f"{low:.3g} to {high:.3g}"
        return f"{angle} degrees"

    def _uncertainty(self) -> str | None:
        """The standard deviation of the noise relative to f_r, in words."""
        if self.samples.sigma is None:
            return None
        level = np.maximum(self.samples.rgb, 0.0).mean(axis=1)
        low, middle, high = np.quantile(
            self.samples.sigma / np.maximum(level, 1e-9), (0.1, 0.5, 0.9)
        )
        return f"{middle:.2%} in the median, {low:.2%} to {high:.2%} for 80 %, standard deviations"

    def _near(
        self, wi: Components, wo: Components, count: int
    ) -> tuple[Neighbours, tuple[int, ...], np.dtype[Any]]:
        """The nearest samples to pairs of directions, and the shape and type of these."""
        given, shape, dtype = self._numbers(wi, wo)
        return self._tree.near(*given, count), shape, dtype

    def _numbers(
        self, wi: Components, wo: Components
    ) -> tuple[tuple[Components, Components], tuple[int, ...], np.dtype[Any]]:
        """Flat arrays of pairs of directions, and their shape and type."""
        given = (*wi, *wo)
        if not all(isinstance(array, np.ndarray | np.generic | float | int) for array in given):
            name = self.name or "this material"
            raise NacreError(
                f"{name}: scattered samples are interpolated in NumPy only; fit a network to it "
                "first (nacre fit), or tabulate it (nacre.measured.merl.tabulate)"
            )
        arrays = np.broadcast_arrays(*(np.asarray(c, np.float64) for c in given))
        x, y, z, u, v, w = (array.reshape(-1) for array in arrays)
        return ((x, y, z), (u, v, w)), arrays[0].shape, np.result_type(*given)

    @cached_property
    def _tree(self) -> SampleTree:
        wi, wo = split(self.samples.wi), split(self.samples.wo)
        return SampleTree(wi, wo, self.isotropic, self.mirrored)

    @cached_property
    def _sharp(self) -> tuple[DirectionSamples, Floats | None]:
        """Samples and spectra, without apertures and bandwidth."""
        samples = self.samples
        rgb: Floats = samples.rgb
        spectra: Floats | None = self.spectra
        if samples.apertures is None and not self.bandwidth:
            return samples, spectra
        if samples.apertures is not None:
            together = rgb if spectra is None else np.hstack([rgb, spectra])
            found = sharpened(self._tree, samples, together)
            rgb, spectra = found[:, :3], None if spectra is None else found[:, 3:]
        if self.bandwidth and spectra is not None and self.wavelengths is not None:
            spectra = narrowed(spectra, self.wavelengths, self.bandwidth)
            rgb = self._in_channels(spectra)
        sigma = samples.sigma
        if sigma is not None:
            before, after = (np.maximum(a, 0.0).mean(axis=1) for a in (samples.rgb, rgb))
            sigma = sigma * np.divide(after, before, out=np.ones_like(after), where=before > 0.0)
        return DirectionSamples(samples.wi, samples.wo, rgb, sigma), spectra

    def _in_channels(self, spectra: Floats) -> Floats:
        """Values (n, 3) of the channels from spectra (n, bands)."""
        assert self.wavelengths is not None
        wanted = {float(name.split()[0]) for name in self.channels if self.channels != COLOR}
        return chosen_channels(spectra, self.wavelengths, sorted(wanted) or "color")[0]

    @cached_property
    def _logs(self) -> Floats:
        return logarithms(self._sharp[0].rgb)

    @cached_property
    def _spectral_logs(self) -> Floats | None:
        _, spectra = self._sharp
        return None if spectra is None else logarithms(spectra)


def tabulate(brdf: Brdf) -> ScatteredBrdf:
    """Samples of a reflectance at :func:`directions`, with its spectra where it has them.

    Directions where `brdf` is not known or not finite are left out; a ValueError says that nothing
    is left.
    """
    check_isotropic(brdf)
    wi, wo = directions(brdf.isotropic)
    rgb = brdf.eval(wi, wo)
    known = np.isfinite(rgb).all(axis=1) & brdf.valid(wi, wo)
    spectra = None if brdf.wavelengths is None else brdf.eval_spectral(wi, wo)
    if spectra is not None:
        known &= np.isfinite(spectra).all(axis=1)
    scan = ScatteredBrdf(
        wi[known],
        wo[known],
        rgb[known],
        brdf.name,
        isotropic=brdf.isotropic,
        spectra=None if spectra is None else spectra[known],
        wavelengths=brdf.wavelengths,
    )
    return scan.replaced(channels=brdf.channels, notes=brdf.notes)


def directions(isotropic: bool) -> tuple[Floats, Floats]:
    """Pairs of directions above the horizon, shapes (n, 3) and (n, 3), float64.

    sqrt(theta_h) and theta_d run evenly from 0 to a right angle; azimuths are evenly spread over
    numbers of steps that fall with the sines of the angles they belong to, and there is one where
    it does not matter. An isotropic grid has phi_h = 0 and phi_d from 0 to pi.
    """
    half, difference = (_HALF, _DIFFERENCE) if isotropic else (_HALF_2, _DIFFERENCE_2)
    rows = []
    for theta_h in 0.5 * math.pi * np.linspace(0.0, 1.0, half) ** 2:
        for theta_d in np.linspace(0.0, 0.5 * math.pi, difference):
            steps = _AZIMUTHS * math.sin(theta_h) * math.sin(theta_d)
            if isotropic:
                phi_h, phi_d = np.zeros(1), np.linspace(0.0, math.pi, math.ceil(steps) + 1)
            else:
                phi_h = _circle(_AZIMUTHS_2 * math.sqrt(math.sin(theta_h)))
                phi_d = _circle(_AZIMUTHS_2 * math.sin(theta_d))
            rows.append(np.stack(np.meshgrid(theta_h, phi_h, theta_d, phi_d), -1).reshape(-1, 4))
    wi, wo = (join(w) for w in from_rusinkiewicz_angles(*np.concatenate(rows).T))
    visible = np.minimum(wi[:, 2], wo[:, 2]) > _GRAZING
    return wi[visible], wo[visible]


def _circle(count: float) -> npt.NDArray[np.float64]:
    """At least one azimuth, evenly from 0 to 2 pi without its end."""
    return np.linspace(0.0, 2.0 * math.pi, max(1, math.ceil(count)), endpoint=False)
