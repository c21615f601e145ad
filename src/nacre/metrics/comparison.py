"""One reflectance against another: the numbers and the pictures."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from nacre.array import Floats, Image, Mask
from nacre.brdf import Brdf
from nacre.color import tone_map
from nacre.latent.estimates import plausible
from nacre.latent.intervals import interval
from nacre.metrics.ldr_flip import displayed_flip
from nacre.metrics.metrics import AngularErrors, ImageErrors, angular_errors, image_errors
from nacre.metrics.verdict import Verdict, verdict
from nacre.mitsuba.environment import Environment
from nacre.mitsuba.lights import DIRECTIONS, DirectionalLight, Light
from nacre.mitsuba.sphere import SIZE, render_sphere, standard_lights

Row = tuple[str, str, float]
"""Where it was measured ("environment", "directional", "angles", ...), the measure, its value."""

BETTER = {
    "SSIM": "higher is better, 1 is equal",
    "PSNR (dB)": "higher is better",
    "MAE": "lower is better, of values from 0 to 1",
    "RMSE": "lower is better",
    "FLIP": "lower is better, 0 is equal, 1 the most",
    "log-cosine error": "lower is better",
    "log-cosine error, 95th percentile": "lower is better",
    "relative error, median": "lower is better",
    "RMSE of f cos (1/sr)": "lower is better",
    "pixels in their 90 % interval": "0.9 is expected",
    "CIEDE2000, D65": "lower is better, 1 is just visible",
    "CIEDE2000, A": "lower is better",
    "CIEDE2000, F11": "lower is better",
}
"""Which way each measure of :meth:`Comparison.rows` gets better."""

_MATERIALS = 32  # plausible materials that are rendered
# of light from the environment: fewer than for errors, as there are many pictures
_PLAUSIBLE_DIRECTIONS = 96


@dataclass(frozen=True)
class LightComparison:
    """The two spheres under one light."""

    light: str  # its name
    truth: Image  # linear picture, shape (size, size, 3), float32; `other` likewise
    other: Image
    flip_map: Floats  # FLIP error of every pixel in [0, 1], shape (size, size)
    errors: ImageErrors
    source: Light  # the light itself


@dataclass(frozen=True)
class PlausibleViews:
    """The sphere under one light, for what is plausible."""

    low: Image  # lower ends of intervals of 90 %, linear, shape (size, size, 3); `high` likewise
    high: Image
    flip_map: Floats  # FLIP error between the two as displayed, shape (size, size)
    inside: float  # fraction of the reference's covered pixels and channels that lie in them


@dataclass(frozen=True)
class Comparison:
    """What :func:`compare` found."""

    truth: str  # names of the reference and of what is judged
    other: str
    mask: Mask  # pixels that the sphere covers, shape (size, size)
    lights: tuple[LightComparison, ...]  # the environment first
    angles: AngularErrors  # over pairs of directions
    materials: tuple[Brdf, Brdf]  # the reference and what is judged
    # alternatives to the latter under the environment, if known from few samples
    plausible: PlausibleViews | None = None
    # mean CIEDE2000 by illuminant, if the reference has spectra
    colors: Mapping[str, float] = field(default_factory=dict)

    @property
    def verdict(self) -> Verdict:
        """Whether a viewer would see the difference, under the light that shows it best."""
        return verdict((item.light, item.flip_map[self.mask]) for item in self.lights)

    def rows(self) -> list[Row]:
        """All figures as a table, in the order in which they should be shown."""
        measures = ("SSIM", "PSNR (dB)", "MAE", "RMSE", "FLIP")
        return [
            *(
                (item.light, measure, getattr(item.errors, measure.split()[0].lower()))
                for item in self.lights
                for measure in measures
            ),
            ("angles", "log-cosine error", self.angles.log_cosine),
            ("angles", "log-cosine error, 95th percentile", self.angles.log_cosine_p95),
            ("angles", "relative error, median", self.angles.relative_median),
            ("angles", "RMSE of f cos (1/sr)", self.angles.rmse_cosine),
            *(
                [("plausible", "pixels in their 90 % interval", self.plausible.inside)]
                if self.plausible
                else []
            ),
            *(("colors", f"CIEDE2000, {light}", value) for light, value in self.colors.items()),
        ]


def compare(
    truth: Brdf,
    other: Brdf,
    *,
    size: int = SIZE,
    directions: int = DIRECTIONS,
    environment: Environment | None = None,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
) -> Comparison:
    """Compare two reflectances by the protocol of :mod:`nacre.mitsuba.sphere`.

    Parameters
    ----------
    truth, other
        The reference and what is judged.
    size
        Pixels along an edge of the pictures, at least 7; figures are comparable at one size only.
    directions
        Light directions per pixel under the environment.
    environment
        The map, exposed here; the package's own where None.
    seed
        Chooses the pairs of directions for the angular errors.
    progress
        Called with the fraction that is done, in (0, 1].

    Raises
    ------
    MissingExtraError
        If scikit-image is not installed.

    Examples
    --------
    >>> from nacre.neural import Layer, NeuralBrdf
    >>> gray = NeuralBrdf([Layer(np.zeros((6, 3), np.float32), np.full(3, 0.2, np.float32))])
    >>> comparison = compare(gray, gray, size=8, directions=8)
    >>> comparison.lights[0].errors.ssim
    1.0
    """
    lights = standard_lights(environment, directions)
    total, done = 2 * sum(light.count for light in lights.values()), 0
    found, mask = [], np.zeros((size, size), bool)
    for name, light in lights.items():
        spheres = []
        for brdf in (truth, other):
            report = (
                None if progress is None else _part(progress, done / total, light.count / total)
            )
            spheres.append(render_sphere(brdf, light, size, progress=report))
            done += light.count
        (a, mask), (b, _) = spheres
        errors, flip_map = image_errors(a, b, mask)
        found.append(LightComparison(name, a, b, flip_map, errors, light))
    return Comparison(
        truth=truth.name or type(truth).__name__,
        other=other.name or type(other).__name__,
        mask=mask,
        lights=tuple(found),
        angles=angular_errors(truth, other, seed=seed),
        materials=(truth, other),
        plausible=_plausible(truth, other, environment, size),
    )


def directional_psnr(truth: Brdf, other: Brdf, size: int = SIZE) -> float:
    """PSNR in dB of the spheres in directional light: that of :func:`compare`, in milliseconds."""
    (a, mask), (b, _) = (render_sphere(brdf, DirectionalLight(), size) for brdf in (truth, other))
    difference = (tone_map(a) - tone_map(b).astype(np.float64))[mask]
    mean = float(np.mean(difference**2))
    return -10.0 * math.log10(mean) if mean else math.inf


def plausible_views(
    truth: Brdf, plausible: Sequence[Brdf], light: Light, size: int
) -> PlausibleViews:
    """Intervals of pictures, and how often the reference lies inside.

    `plausible` are equally plausible materials, one or more, of which :data:`_MATERIALS` count;
    `light` comes from :func:`nacre.mitsuba.sphere.standard_lights`; `size` is in pixels along an
    edge; `fraction` is how often the reference should lie inside.
    """
    image, mask = render_sphere(truth, light, size)
    shown = np.stack([render_sphere(brdf, light, size)[0] for brdf in plausible[:_MATERIALS]])
    # The interval of a few pictures may end below 0, where there is no radiance.
    low, high = (np.maximum(end, 0.0).astype(np.float32) for end in interval(shown))
    inside: Mask = (image >= low) & (image <= high)
    return PlausibleViews(low, high, displayed_flip(low, high), float(inside[mask].mean()))


def _plausible(
    truth: Brdf, other: Brdf, environment: Environment | None, size: int
) -> PlausibleViews | None:
    """Views of what is as plausible as a material known from few samples; None for any other."""
    others = plausible(other)
    if not others:
        return None
    light = standard_lights(environment, _PLAUSIBLE_DIRECTIONS)["environment"]
    return plausible_views(truth, others, light, size)


def _part(
    progress: Callable[[float], None], start: float, length: float
) -> Callable[[float], None]:
    """Progress of one part of the work as progress of the whole."""
    return lambda done: progress(float(min(start + length * done, 1.0)))
