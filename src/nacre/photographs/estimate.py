"""Estimates a material from photographs: reads scenes and pictures, and searches for the code."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Image
from nacre.brdf import Sampler
from nacre.errors import FormatError, NacreError, reason
from nacre.io.files import PathLike, digest, read_bytes
from nacre.io.image_file import HEADER_LIMIT, PIXEL_LIMIT, decode, exr_header
from nacre.latent import find_basis, pretrained_basis
from nacre.latent.estimates import Estimate, plausible_codes
from nacre.latent.hypernetwork import neural_basis
from nacre.latent.neural_basis import NeuralBasis
from nacre.mitsuba.engine import mitsuba
from nacre.mitsuba.environment import load_environment
from nacre.mitsuba.plugins import register
from nacre.mitsuba.scene_file import load_scene_with
from nacre.neural import NeuralBrdf, fit
from nacre.photographs.recording import LOBES, Recording, record, shrunk, sphere_scene
from nacre.photographs.search import (
    Photograph,
    camera_factors,
    posterior_of_photographs,
    unexplained,
)
from nacre.photographs.weights import refine
from nacre.runtime.progress import Progress, silent
from nacre.runtime.store import Store

MAX_PHOTOGRAPHS = 8
ROUNDS = 4
"""Pictures are recorded at most this often, each time with lobes of the latest estimate."""
ENOUGH = 0.1
"""A mean change of the code's values below this ends the rounds."""

NOISE = 0.02
"""Standard deviation of a pixel relative to its value."""

_SIZE_LIMIT = 1 << 30  # bytes of a picture
_ASPECT = 0.01  # by which a picture's shape may differ from the camera's


@dataclass(frozen=True, eq=False)
class Setting:
    """A photographed scene with an unknown material.

    Parameters
    ----------
    load
        Makes Mitsuba's scene, with the plugin `nbrdf` with given properties as the material.
    name
        Id of the material in it.
    where
        Its name in error messages.
    fingerprint
        Distinguishes it from others.
    """

    load: Callable[[dict[str, Any]], Any]
    name: str
    where: str
    fingerprint: str = ""


@dataclass(frozen=True, eq=False)
class Photographed:
    """The result of an estimate from photographs.

    Parameters
    ----------
    estimate
        The material, and equally plausible ones.
    factors
        Camera factors for each photograph, linear RGB, shape (photographs, 3); 1 if known.
    unexplained
        Median absolute difference between logarithms of pixels and of their prediction.
    rounds
        How often pictures were recorded.
    photographs
        The last recordings.
    """

    estimate: Estimate
    factors: npt.NDArray[np.float64]
    unexplained: float
    rounds: int
    photographs: tuple[Photograph, ...]

    def network(self, *, seed: int = 0, progress: Progress = silent) -> NeuralBrdf:
        """A network for the material, whose weights are optimized to match the photographs.

        The network's metadata hold the plausible materials, but only if their basis is the included
        one, which every reader has.
        """
        basis = self.estimate.material.basis
        others = [basis.decode(code) for code in self.estimate.codes]
        expected = fit(self.estimate.material, progress=progress)
        network = refine(
            expected, others, self.photographs, self.factors, seed=seed, progress=progress
        )
        known = basis.fingerprint() == pretrained_basis().fingerprint()
        return self.estimate.kept_by(network) if known else network


def scene_setting(path: PathLike, bsdf: str) -> Setting:
    """A scene file (`.xml`) with a camera for each photograph, whose BSDF with id `bsdf` is
    unknown.

    Its light has the unit of the photographs.
    """

    def load(properties: dict[str, Any]) -> Any:
        return load_scene_with(path, bsdf, "nbrdf", properties)

    return Setting(load, bsdf, str(path), f"{digest(path)} {bsdf}")


def sphere_setting(environment: PathLike) -> Setting:
    """A sphere as :func:`nacre.mitsuba.sphere.render_sphere` shows it, under an environment map."""
    mi = mitsuba()
    pixels = load_environment(environment).pixels
    name = "material"

    def load(properties: dict[str, Any]) -> Any:
        register()
        light = {"type": "envmap", "bitmap": mi.Bitmap(pixels)}
        scene = sphere_scene(light, 1)
        scene["shape"]["bsdf"] = {"type": "nbrdf", "id": name, **properties}
        return mi.load_dict(scene)

    return Setting(load, name, str(environment), digest(environment))


def read_photographs(paths: Sequence[PathLike]) -> list[Image]:
    """Photographs, linear RGB, shape (height, width, 3), float32.

    Raises NacreError if there are none or more than :data:`MAX_PHOTOGRAPHS`; FormatError if one is
    not an OpenEXR picture with R, G and B, or cannot be read.
    """
    _check_count(len(paths))
    return [_read_photograph(path) for path in paths]


def _check_count(count: int) -> None:
    if not 1 <= count <= MAX_PHOTOGRAPHS:
        raise NacreError(f"expected 1 to {MAX_PHOTOGRAPHS} photographs, not {count}")


def _read_photograph(path: PathLike) -> Image:
    data = read_bytes(path, _SIZE_LIMIT)
    header = exr_header(data[:HEADER_LIMIT], path)
    if header.channels != frozenset("RGB"):
        found = ", ".join(sorted(header.channels)) or "none"
        raise FormatError(f"{path}: expected the channels R, G and B alone, not {found[:80]!a}")
    if header.width * header.height > PIXEL_LIMIT:
        raise FormatError(f"{path}: has more than {PIXEL_LIMIT:,} pixels; scale it down")
    return decode(data, header, path).astype(np.float32)


def estimate_from_photographs(
    pictures: Sequence[Image],
    setting: Setting,
    basis_name: str = "neural",
    *,
    camera: str = "known",
    name: str = "",
    called: Sequence[str] = (),
    seed: int = 0,
    state: Path | None = None,
    progress: Progress = silent,
) -> Photographed:
    """A material from photographs of known geometry in known light.

    Directions of light and view at each pixel are recorded along paths through the scene: at first
    with lobes that suit any material, then with those of the estimate, which is put into the scene,
    until it stays the same.

    Parameters
    ----------
    pictures
        Linear RGB, shape (height, width, 3), one to :data:`MAX_PHOTOGRAPHS`; pixels that are not
        finite are ignored.
    setting
        The scene: picture n belongs to camera n, or all belong to the only one.
    basis_name
        See :func:`nacre.latent.find_basis`; a neural basis.
    camera
        One of :data:`nacre.photographs.search.CAMERAS`.
    name
        Of the material.
    called
        Names of the pictures in error messages.
    seed
        For the paths.
    state
        File that keeps finished rounds, so that the same call resumes; the caller removes it.
    progress
        Called with the finished rounds.

    Raises
    ------
    NacreError
        If the pictures do not fit the scene or show nothing of the material, the basis is not a
        neural one, or the state belongs to another call.
    """
    _check_count(len(pictures))
    called = called or [f"photograph {index + 1}" for index in range(len(pictures))]
    basis = neural_basis(find_basis(basis_name))
    store = Store(state, _fingerprint(pictures, setting, basis, camera, seed))
    done, code = 0, np.zeros(basis.code_dim)
    progress("reading the scene", 0, ROUNDS, "")
    included = basis_name in ("neural", "hypernetwork")
    named = basis_name if included else str(Path(basis_name).resolve())
    scene = setting.load({"code": ", ".join(map(str, code)), "basis": named})
    bsdf = _bsdf(scene, setting)
    cameras = _cameras(scene, pictures, called, setting.where)
    small = [shrunk(picture) for picture in pictures]
    lobes: Sampler = LOBES
    if (kept := store.load()) is not None:
        with store.readable():
            done, code = int(kept["rounds"]), kept["code"]
            lobes = _put(bsdf, code)
    while True:
        done += 1
        photographs = []
        for index, picture in enumerate(pictures):
            progress("recording", done - 1, ROUNDS, f"picture {index + 1} of {len(pictures)}")
            size = picture.shape[0], picture.shape[1]
            try:
                recording = record(scene, cameras[index], bsdf, size, lobes, seed=seed + index)
                photographs.append(_photograph(small[index], recording))
            except (NacreError, RuntimeError) as error:
                where = f"{called[index]}: with {setting.where}"
                raise NacreError(f"{where}: {reason(error)}") from error
        progress("estimating", done - 1, ROUNDS, "")
        found = posterior_of_photographs(basis, photographs, camera)
        change, code = float(np.abs(found.code - code).mean()), found.code
        if change < ENOUGH or done == ROUNDS:
            break
        lobes = _put(bsdf, code)
        store.save({"rounds": done, "code": code})
    progress("estimating", ROUNDS, ROUNDS, "")
    pixels = sum(len(photograph.values) for photograph in photographs)
    factors = camera_factors(found, len(pictures), camera)
    return Photographed(
        Estimate(basis.decode(code, name), plausible_codes(found), pixels, observed="pixels"),
        factors,
        unexplained(basis, code, photographs, factors),
        done,
        tuple(photographs),
    )


def _fingerprint(
    pictures: Sequence[Image], setting: Setting, basis: NeuralBasis, camera: str, seed: int
) -> str:
    """Everything that decides the rounds of an estimate."""
    whole = hashlib.sha256()
    for picture in pictures:
        whole.update(f"{picture.shape}".encode() + np.ascontiguousarray(picture).tobytes())
    return f"{whole.hexdigest()} {setting.fingerprint} {basis.fingerprint()} {camera} {seed}"


def _bsdf(scene: Any, setting: Setting) -> Any:
    """The unknown material, from the shapes of a scene."""
    for shape in scene.shapes():
        if shape.bsdf() is not None and shape.bsdf().id() == setting.name:
            return shape.bsdf()
    raise NacreError(
        f"{setting.where}: no shape has the BSDF {setting.name!r} itself; name the outermost one"
    )


def _cameras(scene: Any, pictures: Sequence[Image], called: Sequence[str], where: str) -> list[int]:
    """The camera index for each picture."""
    sensors = scene.sensors()
    if len(sensors) not in (1, len(pictures)):
        raise NacreError(
            f"{where}: has {len(sensors)} sensors for {len(pictures)} photographs; it needs one "
            "for each, in their order, or one for all"
        )
    cameras = [min(index, len(sensors) - 1) for index in range(len(pictures))]
    for index, picture, name in zip(cameras, pictures, called, strict=True):
        width, height = (int(v) for v in sensors[index].film().crop_size())
        rows, columns = picture.shape[:2]
        if abs(columns * height - rows * width) > _ASPECT * rows * width:
            raise NacreError(
                f"{name}: has {columns} x {rows} pixels; its sensor in {where} has another shape, "
                f"{width} x {height}"
            )
    return cameras


def _photograph(picture: npt.NDArray[np.float64], recording: Recording) -> Photograph:
    """The recorded pixels of a picture that are finite."""
    rows, columns = recording.pixels.T
    values = picture[rows, columns]
    whole = np.isfinite(values).all(axis=1)
    if not whole.any():
        raise NacreError("no pixel of the material is finite")
    if not values[whole].mean() > 0.0:
        raise NacreError("every pixel of the material is black")
    kept = (v[whole] for v in (recording.pixels, recording.wi, recording.wo, recording.weights))
    return Photograph(values[whole], Recording(*kept), NOISE * np.abs(values[whole]))


def _put(bsdf: Any, code: npt.NDArray[np.float64]) -> Sampler:
    """Change the code of a material in a scene; returns its lobes."""
    mi = mitsuba()
    parameters = mi.traverse(bsdf)
    parameters["code"] = mi.Float(code.astype(np.float32))
    parameters.update()
    lobes: Sampler = bsdf.material().sampler
    return lobes
