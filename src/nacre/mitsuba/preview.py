"""Pictures of a material on an object, rendered by Mitsuba."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.array import Image
from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.color import tone_map
from nacre.errors import FormatError, NacreError
from nacre.io.files import PathLike, atomic_path
from nacre.io.image_file import bitmaps, write_exr
from nacre.mitsuba.denoise import can_denoise
from nacre.mitsuba.denoise import denoise as remove_noise
from nacre.mitsuba.engine import mitsuba
from nacre.mitsuba.environment import Environment
from nacre.mitsuba.passes import (
    Accumulation,
    accumulate,
    needs_wavefronts,
    pass_sizes,
    plan_passes,
    wavefronts,
)
from nacre.mitsuba.plugins import bsdf
from nacre.mitsuba.scene import describe_scene
from nacre.runtime.store import Store

DISPLAY_IMAGES = (".png", ".jpg", ".jpeg")
"""Endings of the files that :func:`write_bytes` writes."""

IMAGES = (".exr", *DISPLAY_IMAGES)
"""Endings of the files that :func:`write_image` writes."""

MAX_SIZE = 8192
"""Longest edge of a picture in pixels."""

DENOISED_SPP, PLAIN_SPP = 24, 40
"""Default samples per pixel with and without the denoiser; the latter take about 10 seconds on two
cores."""
_AUXILIARY_SPP = 8


def render_preview(
    material: Any,
    shape: str = "ball",
    light: str = "environment",
    size: int | tuple[int, int] = 512,
    spp: int | None = None,
    seed: int = 0,
    environment: Environment | None = None,
    progress: Callable[[float], None] | None = None,
    denoise: bool = True,
    store: Store | None = None,
) -> Image:
    """Render a material on an object by path tracing.

    A white Lambertian material has about radiance 0.8 where the light falls.

    Parameters
    ----------
    material
        Any reflectance, a Mitsuba BSDF, or the dictionary of one.
    shape
        One of :data:`nacre.mitsuba.scene.SHAPES`.
    light
        One of :data:`nacre.mitsuba.scene.LIGHTS`.
    size
        Edge, or width and height, in pixels; at most :data:`MAX_SIZE`.
    spp
        Samples per pixel, at least 1; by default :func:`default_spp`.
    seed
        The same seed gives the same picture, except for rounding without the denoiser: samples
        then count for pixels around theirs, and the renderer's threads add them in any order.
    environment
        The map, exposed here; by default the package's own.
    progress
        Called with the finished fraction, in (0, 1], after each pass.
    denoise
        Whether to remove noise, where the denoiser is installed.
    store
        See :class:`nacre.mitsuba.passes.Accumulation`.

    Returns
    -------
    array of shape (height, width, 3)
        Linear Rec. 709 RGB, float32.

    Raises
    ------
    NacreError
        If there is no such shape or light, a number is out of range, or the picture does not fit
        into memory.
    MissingExtraError
        If Mitsuba is not installed.
    LLVMError
        If there is no LLVM that Mitsuba can use.
    """
    width, height = (size, size) if isinstance(size, int) else size
    if not (1 <= width <= MAX_SIZE and 1 <= height <= MAX_SIZE):
        raise NacreError(f"a picture has 1 to {MAX_SIZE} pixels per edge, not {width} x {height}")
    if spp is None:
        spp = default_spp(denoise)
    if spp < 1:
        raise NacreError(f"a picture needs at least 1 sample per pixel, not {spp}")
    mitsuba()
    shown = bsdf(material) if isinstance(material, Brdf | Btf) else material
    scene = describe_scene(shown, shape, light, (width, height), environment)
    return render_scene(scene, spp, seed, progress, denoise, store)


def default_spp(denoise: bool = True, plain: int = PLAIN_SPP) -> int:
    """The default samples per pixel of a preview; `plain` if it is not denoised."""
    return DENOISED_SPP if denoise and can_denoise() else plain


def render_scene(
    scene: Any,
    spp: int,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
    denoise: bool = False,
    store: Store | None = None,
    name: str = "",
) -> Image:
    """Render a scene, or the dictionary of one; see :func:`render_preview` for the rest.

    The film holds linear RGB. A scene that is already loaded is never denoised, because its film
    may share samples between pixels. Raises NacreError if the picture does not fit into memory.
    """
    mi = mitsuba()
    clean = denoise and isinstance(scene, dict) and can_denoise()
    if clean:
        film = scene["sensor"]["film"] | {"rfilter": {"type": "box"}}
        scene = scene | {"sensor": scene["sensor"] | {"film": film}}
    loaded = mi.load_dict(scene) if isinstance(scene, dict) else scene
    wavefront = needs_wavefronts(loaded)
    width, height = (int(v) for v in loaded.sensors()[0].film().crop_size())
    plan = plan_passes(width, height, spp, wavefront, clean)
    sizes = pass_sizes([spp], plan.samples)
    picture: npt.NDArray[np.float64] = np.zeros((1, 1, 3))
    with wavefronts() if wavefront else nullcontext():
        for done, picture in accumulate(  # noqa: B007 - the last
            loaded, sizes, seed, plan.rows, store=store, name=name
        ):
            if progress is not None:
                progress(done / spp)
        if clean:
            return remove_noise(picture, *first_hits(mi, loaded, seed, plan.rows))
    return picture.astype(np.float32)


def first_hits(
    mi: Any, scene: Any, seed: int, rows: int, sensor: int = 0
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Albedo and normals of what a scene's sensor sees, for the denoiser of its picture."""
    auxiliary = mi.load_dict({"type": "aov", "aovs": "albedo:albedo,normal:sh_normal"})
    seen = Accumulation(scene, [_AUXILIARY_SPP], seed + 1, rows, auxiliary, sensor)
    for _ in seen.passes():
        pass
    return seen.mean()[..., -6:-3], seen.mean()[..., -3:]


def check_image_path(path: PathLike, endings: Sequence[str] = IMAGES) -> Path:
    """The path, if its ending is one of `endings`, else FormatError; call it before a long
    rendering.
    """
    path = Path(path)
    if path.suffix.lower() not in endings:
        raise FormatError(f"{path}: a picture ends in one of {', '.join(endings)}")
    return path


def write_image(image: npt.NDArray[np.floating], path: PathLike) -> None:
    """Write a linear Rec. 709 RGB picture, shape (height, width, 3), whole or not at all.

    `.exr` keeps linear float32 values; `.png` and `.jpg` are clipped to [0, 1] and get a gamma of
    2.2 (:func:`nacre.color.tone_map`). Raises FormatError if the ending is none of these or the
    file cannot be written; MissingExtraError if Mitsuba (for `.exr`) is not installed.
    """
    path = check_image_path(path)
    if path.suffix.lower() == ".exr":
        write_exr(bitmaps().Bitmap(np.ascontiguousarray(image, np.float32)), path)
        return
    write_bytes(np.rint(tone_map(image) * 255.0).astype(np.uint8), path)


def write_bytes(image: npt.NDArray[np.uint8], path: PathLike) -> None:
    """Write a picture of display values, shape (height, width, 3), as `.png` or `.jpg`.

    Raises FormatError if the ending is none of these or the file cannot be written.
    """
    from PIL import Image

    path = check_image_path(path, DISPLAY_IMAGES)
    with atomic_path(path) as temporary:
        Image.fromarray(image).save(temporary, quality=95)
