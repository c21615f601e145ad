"""Pictures of a material on an object, rendered by Mitsuba."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.brdf import Brdf
from nacre.color import tone_map
from nacre.errors import FormatError, NacreError, require
from nacre.io.files import PathLike, atomic_path
from nacre.io.image_file import bitmaps
from nacre.render.engine import mitsuba
from nacre.render.environment import Environment
from nacre.render.passes import (
    PASS,
    accumulate,
    needs_wavefronts,
    pass_sizes,
    wavefront_pass,
    wavefronts,
)
from nacre.render.plugins import bsdf
from nacre.render.scene import describe_scene

Image = npt.NDArray[np.float32]

DISPLAY_IMAGES = (".png", ".jpg", ".jpeg")
"""Endings of the files that :func:`write_bytes` writes."""

IMAGES = (".exr", *DISPLAY_IMAGES)
"""Endings of the files that :func:`write_image` writes."""

MAX_SIZE = 8192
"""Longest edge of a picture in pixels."""


def render_preview(
    material: Any,
    shape: str = "ball",
    light: str = "environment",
    size: int | tuple[int, int] = 512,
    spp: int = 256,
    seed: int = 0,
    environment: Environment | None = None,
    progress: Callable[[float], None] | None = None,
) -> Image:
    """Render a material on an object by path tracing.

    A white Lambertian material has about radiance 0.8 where the light falls.

    Parameters
    ----------
    material
        Any reflectance; or a BSDF of Mitsuba's, or the dictionary of one.
    shape
        One of :data:`nacre.render.scene.SHAPES`.
    light
        One of :data:`nacre.render.scene.LIGHTS`.
    size
        Edge, or width and height, in pixels; at most :data:`MAX_SIZE`.
    spp
        Samples per pixel, at least 1; rendered a few at a time.
    seed
        Of the samples: the same seed gives the same picture, but for the rounding of sums whose
        order the renderer's threads decide.
    environment
        The map, exposed here; the package's own where None.
    progress
        Called with the part that is done, in (0, 1], after each pass.

    Returns
    -------
    array of shape (height, width, 3)
        Linear Rec. 709 RGB, float32.

    Raises
    ------
    NacreError
        If there is no such shape or light, or a number is out of range.
    MissingExtraError
        If Mitsuba is not installed.
    LLVMError
        If there is no LLVM that Mitsuba can use.
    """
    width, height = (size, size) if isinstance(size, int) else size
    if not (1 <= width <= MAX_SIZE and 1 <= height <= MAX_SIZE):
        raise NacreError(f"a picture has 1 to {MAX_SIZE} pixels an edge, not {width} x {height}")
    if spp < 1:
        raise NacreError(f"a picture needs at least 1 sample per pixel, not {spp}")
    mitsuba()
    shown = bsdf(material) if isinstance(material, Brdf) else material
    scene = describe_scene(shown, shape, light, (width, height), environment)
    return render_scene(scene, spp, seed, progress)


def render_scene(
    scene: Any,
    spp: int,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
) -> Image:
    """Render a scene, or the dictionary of one; see :func:`render_preview` for the rest."""
    loaded = mitsuba().load_dict(scene) if isinstance(scene, dict) else scene
    wavefront = needs_wavefronts(loaded)
    sizes = pass_sizes([spp], wavefront_pass(loaded) if wavefront else PASS)
    picture: npt.NDArray[np.float64] = np.zeros((1, 1, 3))
    with wavefronts() if wavefront else nullcontext():
        for done, picture in accumulate(loaded, sizes, seed):  # noqa: B007 - the last one
            if progress is not None:
                progress(done / spp)
    return picture.astype(np.float32)


def check_image_path(path: PathLike, endings: Sequence[str] = IMAGES) -> Path:
    """The path, if its ending is one of `endings`; to be called before a long rendering.

    Raises
    ------
    FormatError
        If it is not.
    """
    path = Path(path)
    if path.suffix.lower() not in endings:
        raise FormatError(f"{path}: a picture ends in one of {', '.join(endings)}")
    return path


def write_image(image: npt.NDArray[np.floating], path: PathLike) -> None:
    """Write a linear picture, whole or not at all.

    Parameters
    ----------
    image
        Linear Rec. 709 RGB, shape (height, width, 3).
    path
        `.exr` keeps linear float32 values; `.png` and `.jpg` are clipped to [0, 1] and get a gamma
        of 2.2 (:func:`nacre.color.tone_map`).

    Raises
    ------
    FormatError
        If the ending is none of these or the file cannot be written.
    MissingExtraError
        If Mitsuba (for `.exr`) or Pillow is not installed.
    """
    path = check_image_path(path)
    if path.suffix.lower() == ".exr":
        mi = bitmaps()
        try:
            with atomic_path(path) as temporary:
                mi.Bitmap(np.ascontiguousarray(image, np.float32)).write(str(temporary))
        except RuntimeError as error:
            raise FormatError(f"{path}: cannot be written") from error
        return
    write_bytes(np.rint(tone_map(image) * 255.0).astype(np.uint8), path)


def write_bytes(image: npt.NDArray[np.uint8], path: PathLike) -> None:
    """Write a picture of display values, shape (height, width, 3), as `.png` or `.jpg`.

    Raises
    ------
    FormatError
        If the ending is none of these or the file cannot be written.
    MissingExtraError
        If Pillow is not installed.
    """
    path = check_image_path(path, DISPLAY_IMAGES)
    pillow = require("PIL.Image", "render")
    with atomic_path(path) as temporary:
        pillow.fromarray(image).save(temporary, quality=95)
