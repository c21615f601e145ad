"""`nacre.estimate`: a material from photographs in known light, or from readings."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from nacre.array import Image
from nacre.errors import NacreError
from nacre.instruments.readings import Reading
from nacre.instruments.readings_file import load_readings
from nacre.io.files import PathLike
from nacre.measuring.estimated import FromReadings, estimate_from_readings
from nacre.neural import NeuralBrdf
from nacre.photographs.estimate import (
    Photographed,
    estimate_from_photographs,
    read_photographs,
    scene_setting,
    sphere_setting,
)
from nacre.runtime.progress import Progress, silent

Photo: TypeAlias = PathLike | npt.NDArray[np.floating]

DOUBTFUL = 0.2
"""Median difference of the logarithms of pixels above which the scene is probably wrong."""


def estimate(
    photographs: Photo | Sequence[Photo] = (),
    *,
    readings: PathLike | Sequence[Reading] | None = None,
    scene: PathLike | None = None,
    bsdf: str | None = None,
    geometry: str | None = None,
    environment: PathLike | None = None,
    camera: str = "known",
    basis: PathLike = "neural",
    seed: int = 0,
    progress: Progress | None = None,
) -> NeuralBrdf:
    """Estimate an isotropic material from photographs in known light, or from readings.

    From one to eight photographs: `estimate("photo.exr", scene="scene.xml", bsdf="paint")`, or of a
    sphere: `estimate("photo.exr", geometry="sphere", environment="studio.exr")`. From what
    instruments read: `estimate(readings="readings.csv")`.

    Parameters
    ----------
    photographs
        OpenEXR files with linear values in the same unit as the light, or arrays of linear RGB,
        shape (height, width, 3).
    readings
        In place of photographs: a file (`.csv`) of what glossmeters and other instruments read, or
        a list of :class:`nacre.instruments.Reading`.
    scene, bsdf
        Mitsuba scene (`.xml`) that was photographed, with one camera or one for each photograph,
        and the id of the BSDF in it to estimate.
    geometry, environment
        In place of a scene: "sphere", a distant one with a margin of 3 % of the picture, and the
        latitude-longitude map (`.exr`, `.hdr`) that lights it.
    camera
        Calibration: "known", "exposure" or "white-balance", where these are unknown.
    basis
        Latent basis, "neural", "hypernetwork" or a file.
    seed
        Of the paths through the scene.
    progress
        Called with the finished rounds.

    Returns
    -------
    NeuralBrdf
        The network; :func:`nacre.plot` and :func:`nacre.info` show how certain it is.

    Raises
    ------
    NacreError
        If it is not said what was photographed, a file cannot be read, the pictures do not fit the
        scene, or there are readings too.
    MissingExtraError
        If Mitsuba is not installed.

    Warns
    -----
    UserWarning
        If no material explains the photographs, or all of the readings.
    """
    if readings is not None:
        photos = (photographs, scene, bsdf, geometry, environment)
        if any(isinstance(each, np.ndarray) or each for each in photos):
            raise NacreError("an estimate takes photographs or readings, not both")
        read = from_readings(readings, basis=basis, progress=progress or silent)
        for line in doubts(read):
            warnings.warn(line, stacklevel=2)
        return read.network(progress=progress or silent)
    found = photographed(
        photographs,
        scene=scene,
        bsdf=bsdf,
        geometry=geometry,
        environment=environment,
        camera=camera,
        basis=basis,
        seed=seed,
        progress=progress or silent,
    )
    if found.unexplained > DOUBTFUL:
        warnings.warn(
            "no material explains the photographs: check the scene, the light and its unit, and "
            "camera=",
            stacklevel=2,
        )
    return found.network(seed=seed, progress=progress or silent)


def from_readings(
    readings: PathLike | Sequence[Reading],
    *,
    basis: PathLike = "neural",
    name: str = "",
    progress: Progress = silent,
) -> FromReadings:
    """What :func:`estimate` makes a network from, given a file of readings, or readings."""
    if isinstance(readings, Sequence) and not isinstance(readings, str):
        read = readings
    else:
        name = name or Path(readings).stem
        read = load_readings(readings)
    return estimate_from_readings(read, str(basis), name=name, progress=progress)


def doubts(read: FromReadings) -> list[str]:
    """What to say about readings that the estimate does not explain."""
    return [
        f"{reading.quantity.name}: no material that is plausible explains this reading together "
        "with the others: check it, its unit and its geometry"
        for reading in read.doubtful
    ]


def photographed(
    photographs: Photo | Sequence[Photo],
    *,
    scene: PathLike | None,
    bsdf: str | None,
    geometry: str | None,
    environment: PathLike | None,
    camera: str = "known",
    basis: PathLike = "neural",
    name: str = "",
    seed: int = 0,
    state: Path | None = None,
    progress: Progress = silent,
) -> Photographed:
    """What :func:`estimate` makes a network from; `state` as
    :func:`nacre.photographs.estimate.estimate_from_photographs` takes it.
    """
    if (scene is None) == (geometry is None):
        raise NacreError(
            'say what was photographed: scene="scene.xml", bsdf="id"; or geometry="sphere", '
            'environment="map.exr"'
        )
    if scene is not None and (bsdf is None or environment is not None):
        raise NacreError("a scene has its own light, and needs the id of a BSDF: bsdf=...")
    if geometry is not None and (environment is None or bsdf is not None):
        raise NacreError("a geometry has one material, and needs its light: environment=...")
    if geometry not in (None, "sphere"):
        raise NacreError(f'{geometry!r} is no known geometry; write geometry="sphere"')
    several = _several(photographs)
    called = [
        f"photograph {index}" if isinstance(each, np.ndarray) else str(each)
        for index, each in enumerate(several, 1)
    ]
    pictures = [_picture(each) for each in several]
    setting = (
        sphere_setting(environment or "") if scene is None else scene_setting(scene, bsdf or "")
    )
    return estimate_from_photographs(
        pictures,
        setting,
        str(basis),
        camera=camera,
        name=name or Path(called[0]).stem if called else name,
        called=called,
        seed=seed,
        state=state,
        progress=progress,
    )


def _several(photographs: Photo | Sequence[Photo]) -> list[Photo]:
    one = isinstance(photographs, str | Path) or (
        isinstance(photographs, np.ndarray) and photographs.ndim == 3
    )
    return [photographs] if one else list(photographs)  # type: ignore[list-item, arg-type]


def _picture(photo: Photo) -> Image:
    if not isinstance(photo, np.ndarray):
        (read,) = read_photographs([photo])
        return read
    if photo.ndim != 3 or photo.shape[2] != 3:
        raise NacreError(f"a photograph has the shape (height, width, 3), not {photo.shape}")
    return np.asarray(photo, np.float32)
