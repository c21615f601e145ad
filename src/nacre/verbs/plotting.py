"""`nacre.plot`: lobes, or spectra, of materials over one another."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.errors import NacreError, printable
from nacre.figures.plot import INCIDENCE, lobe_figure, write_plot
from nacre.figures.spectrum import spectrum_figure
from nacre.io.files import PathLike
from nacre.runtime.progress import Progress, silent
from nacre.verbs.material import Given, label, opened

_DEGREES = tuple(math.degrees(angle) for angle in INCIDENCE)


@dataclass(frozen=True, repr=False, eq=False)
class Plot:
    """A figure that notebooks show."""

    materials: tuple[str, ...]  # what is drawn, in this order
    figure: Any
    """Matplotlib's `Figure`, for any use of Matplotlib."""

    def save(self, path: PathLike) -> Path:
        """Write it: `.png`, `.svg` or `.pdf`; returns the path."""
        write_plot(self.figure, path)
        return Path(path)

    def __repr__(self) -> str:
        return f"<Plot of {', '.join(self.materials)}; .save(path) writes it>"

    def _repr_svg_(self) -> str:
        stream = io.StringIO()
        self.figure.savefig(stream, format="svg", metadata={"Date": None})
        return stream.getvalue()


def plot(
    *materials: Given,
    spectrum: bool = False,
    texel: tuple[int, int] | None = None,
    incidence: float | Sequence[float] = _DEGREES,
    azimuth: float = 0.0,
    channel: str = "luminance",
    cosine: bool = False,
    floor: float | None = None,
    progress: Progress | None = None,
) -> Plot:
    """Plot the lobes of materials over one another, in the plane of incidence, on a log scale.

    The first of several materials is a wide gray line below the others. Lines have gaps where
    nothing was measured.

    Parameters
    ----------
    materials
        Up to seven materials, paths or names; of a texture the mean is drawn, or one `texel`.
    spectrum
        Plot f_r of materials with bands over wavelength, in the mirror direction and for a viewer
        at the normal; `channel`, `cosine` and `floor` are for lobes.
    texel
        Column and row of the texel of a texture, from 0.
    incidence
        Angles of the light from the normal, in degrees.
    azimuth
        Of the plane of incidence, in degrees, for anisotropic materials.
    channel
        "luminance", "red", "green", "blue" or "rgb".
    cosine
        Multiply by the cosine of the viewing angle.
    floor
        Value at the center in 1/sr; a power of ten below the plotted values where None.
    progress
        Called while textures are read.

    Raises
    ------
    NacreError
        If a material cannot be read, there are too many, or nothing is known in this plane,
        or a material has no spectrum to plot.
    ValueError
        If another argument is out of range, or is for lobes and there is a `spectrum`.
    MissingExtraError
        If Matplotlib is not installed.
    """
    if not materials:
        raise TypeError("plot() takes at least one material: nacre.plot(material)")
    named: dict[str, Brdf] = {}
    for given in materials:
        material = opened(given)
        if isinstance(material, Btf):
            brdf = _of_texture(material, texel, progress or silent)
        else:
            brdf = material
        named[_apart(printable(label(given)), material, named)] = brdf
    angles = [incidence] if isinstance(incidence, float | int) else list(incidence)
    if not all(0.0 <= angle < 90.0 for angle in angles):
        raise NacreError(f"incidence lies from 0 to below 90 degrees, not at {incidence}")
    radians, turn = [math.radians(angle) for angle in angles], math.radians(azimuth)
    if spectrum:
        if (channel, cosine, floor) != ("luminance", False, None):
            raise ValueError("channel, cosine and floor are for lobes; leave them or spectrum out")
        return Plot(tuple(named), spectrum_figure(named, radians, azimuth=turn))
    figure = lobe_figure(
        named,
        radians,
        azimuth=turn,
        channel=channel,
        cosine=cosine,
        floor=floor,
    )
    return Plot(tuple(named), figure)


def _of_texture(texture: Btf, texel: tuple[int, int] | None, progress: Progress) -> Brdf:
    from nacre.workflows.texel import texture_reflectance

    return texture_reflectance(texture, texel, progress)


def _apart(name: str, material: object, known: dict[str, Brdf]) -> str:
    """The name, with the class and then a number where another material has it."""
    if name not in known:
        return name
    name, count = f"{name} ({type(material).__name__})", 1
    distinct = name
    while distinct in known:
        count += 1
        distinct = f"{name} {count}"
    return distinct
