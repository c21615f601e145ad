"""A trial of a method on a material: its representation, and the errors."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Floats, Image
from nacre.brdf import Brdf
from nacre.color import tone_map
from nacre.errors import require
from nacre.metrics.metrics import angular_errors, image_errors
from nacre.mitsuba.environment import Environment
from nacre.mitsuba.lights import DIRECTIONS, Light
from nacre.mitsuba.sphere import SIZE, Mask, render_sphere, standard_lights

Figures = Mapping[str, float]
"""Values by the names in :data:`FIGURES`, such as "environment SSIM"."""

LIGHTS = ("environment", "directional")
MEASURES = ("SSIM", "PSNR", "MAE", "RMSE", "FLIP")
ANGLES = ("angular relative error", "log-cosine error")
FIGURES = (*(f"{light} {measure}" for light in LIGHTS for measure in MEASURES), *ANGLES)
HIGHER_IS_BETTER = ("SSIM", "PSNR")


TRUTH = "truth"
"""Name of the method that keeps a material as it is."""


@dataclass(frozen=True)
class Method:
    """One way to represent a material.

    Parameters
    ----------
    about
        A few words about it.
    fit
        Makes the representation of a material; raises :class:`nacre.NacreError` if it cannot.
    family
        "network", "analytic" or "table", for grouping in figures.
    settings
        JSON-able settings, which distinguish results.
    """

    about: str
    fit: Callable[[Brdf], Brdf]
    family: str
    settings: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Settings:
    """Settings shared by all trials of an experiment.

    Parameters
    ----------
    size
        Pixels along an edge of the pictures.
    directions
        Light directions at a pixel under the environment.
    epochs, samples
        For networks; see :class:`nacre.neural.Recipe`.
    seed
        Seed of fits and of pairs of directions.
    environment
        The map; the included one if None.
    """

    size: int = SIZE
    directions: int = DIRECTIONS
    epochs: int = 100
    samples: int | None = None
    seed: int = 0
    environment: Environment | None = field(default=None, compare=False)

    @cached_property
    def lights(self) -> Mapping[str, Light]:
        """The lights of the pictures by name."""
        return standard_lights(self.environment, self.directions)

    @cached_property
    def facts(self) -> dict[str, int | str | None]:
        """What determines the pictures, JSON-able, with the hash of the map."""
        pixels = b"" if self.environment is None else self.environment.pixels.tobytes()
        facts = asdict(self) | {"environment": hashlib.sha256(pixels).hexdigest()}
        return {k: v for k, v in facts.items() if k not in ("epochs", "samples")}

    def summary(self) -> str:
        """The settings in one line."""
        samples = (
            "as many samples as usual" if self.samples is None else f"{self.samples:,} samples"
        )
        networks = f"networks trained for {self.epochs} epochs on {samples}"
        return f"{self.pictures()}; {networks}; seed {self.seed}"

    def pictures(self) -> str:
        """The settings of pictures, as text."""
        lit = "the built-in studio" if self.environment is None else self.environment.name
        return (
            f"spheres {self.size} pixels wide, {self.directions} directions of light, environment "
            f"{lit or 'given'}"
        )


@dataclass(frozen=True)
class Picture:
    """A sphere under one light.

    Parameters
    ----------
    shown
        Tone-mapped bytes, shape (size, size, 3).
    similarity
        SSIM against the material itself, shape (size, size), float16.
    mask
        Pixels that the sphere covers, shape (size, size).
    """

    shown: npt.NDArray[np.uint8]
    similarity: npt.NDArray[np.float16]
    mask: Mask


@dataclass(frozen=True)
class Trial:
    """The result of a trial.

    Names, bytes of the representation, seconds of the fit, and errors by :data:`FIGURES`.
    """

    material: str
    method: str
    size: int
    seconds: float
    figures: Figures


@dataclass(frozen=True)
class Reference:
    """A material, its displayed name, and its spheres, rendered once."""

    name: str
    brdf: Brdf
    settings: Settings

    @cached_property
    def spheres(self) -> dict[str, tuple[Image, Mask]]:
        """Linear picture and mask under each light."""
        lights, size = self.settings.lights, self.settings.size
        return {name: render_sphere(self.brdf, light, size) for name, light in lights.items()}


def attempt(
    reference: Reference, name: str, method: Method
) -> tuple[Trial, dict[str, Picture], Brdf]:
    """Fit a method to a material, and compare: figures, spheres by light, representation.

    Raises
    ------
    NacreError
        If the method cannot represent this material.
    """
    truth, settings = reference.brdf, reference.settings
    start = time.perf_counter()
    fitted = method.fit(truth)
    seconds = time.perf_counter() - start
    figures: dict[str, float] = {}
    pictures: dict[str, Picture] = {}
    for light_name, light in settings.lights.items():
        image, mask = reference.spheres[light_name]
        other = image if fitted is truth else render_sphere(fitted, light, settings.size)[0]
        errors, _ = image_errors(image, other, mask)
        figures |= {f"{light_name} {m}": float(getattr(errors, m.lower())) for m in MEASURES}
        first, shown = tone_map(image), tone_map(other)
        similarity = _similarity_map(first, shown).astype(np.float16)
        pictures[light_name] = Picture(np.rint(255.0 * shown).astype(np.uint8), similarity, mask)
    angles = angular_errors(truth, fitted, seed=settings.seed)
    figures |= dict(zip(ANGLES, (angles.relative_median, angles.log_cosine), strict=True))
    return Trial(reference.name, name, fitted.nbytes or 0, seconds, figures), pictures, fitted


def _similarity_map(truth: Floats, other: Floats) -> Floats:
    """SSIM (Wang et al. 2004) about every pixel of two pictures of display values, 7 x 7 pixels or
    more: of a window of that size, with channels averaged.
    """
    metrics = require("skimage.metrics", "render")
    _, whole = metrics.structural_similarity(
        truth, other, channel_axis=-1, data_range=1.0, full=True
    )
    return np.asarray(np.asarray(whole).mean(axis=-1))
