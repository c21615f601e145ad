"""Animations: several pictures in one file, shown in an endless loop."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.errors import FormatError, NacreError
from nacre.io.files import PathLike, atomic_path
from nacre.mitsuba.preview import check_image_path

ANIMATIONS = (".gif", ".png", ".webp")
"""Endings of the files that :func:`write_animation` writes."""

FRAME_MILLISECONDS = 80
"""How long each frame is shown; .gif allows multiples of 10."""

MAX_PIXELS = 1 << 26
"""Limit on the pixels of all frames together: Pillow holds them, at up to eight bytes each."""

_SAMPLED = 1 << 18  # about how many pixels of an animation its palette is computed from


def check_animation(path: PathLike, count: int, width: int, height: int) -> None:
    """Refuse an animation before it is rendered.

    Raises FormatError if the ending is none of :data:`ANIMATIONS`, or a .webp file cannot be that
    large; NacreError if all frames together have more than :data:`MAX_PIXELS` pixels.
    """
    path = check_image_path(path, ANIMATIONS)
    if path.suffix.lower() == ".webp" and max(width, height) > 16383:
        raise FormatError(f"{path}: .webp has at most 16383 pixels per edge; choose .gif or .png")
    if count * width * height > MAX_PIXELS:
        raise NacreError(
            f"{count} frames of {width} x {height} pixels are more than the {MAX_PIXELS:,} pixels "
            "that an animation may have: make fewer or smaller ones"
        )


def write_animation(frames: Iterable[npt.NDArray[np.uint8]], path: PathLike) -> None:
    """Write two or more pictures of display values as an animation, whole or not at all.

    A `.gif` has one palette of 256 colors for all frames; `.png` is lossless, `.webp` lossy.

    Raises FormatError if the ending is none of these or the file cannot be written.
    """
    from PIL import Image

    path = check_image_path(path, ANIMATIONS)
    images = [Image.fromarray(frame) for frame in frames]
    options: dict[str, Any] = {"duration": FRAME_MILLISECONDS, "loop": 0}
    if path.suffix.lower() == ".gif":
        palette = _palette(images)
        images = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images]
        options |= {"optimize": False}
    elif path.suffix.lower() == ".webp":
        options |= {"quality": 90}
    with atomic_path(path) as temporary:
        images[0].save(temporary, save_all=True, append_images=images[1:], **options)


def _palette(images: list[Any]) -> Any:
    from PIL import Image

    # Of Pillow's methods, this one has a small error and flickers little; dithering flickers more.
    step = max(1, round((sum(i.width * i.height for i in images) / _SAMPLED) ** 0.5))
    sampled = np.concatenate([np.array(i)[::step, ::step].reshape(-1, 3) for i in images])
    return Image.fromarray(sampled[None]).quantize(256, Image.Quantize.MAXCOVERAGE, kmeans=1)
