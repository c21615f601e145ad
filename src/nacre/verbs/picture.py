"""A picture that notebooks show."""

from __future__ import annotations

import io
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.color import tone_map
from nacre.errors import NacreError
from nacre.io.files import PathLike

_ANIMATED = 4  # axes: frames, rows, columns, colors


class Picture(np.ndarray[Any, np.dtype[Any]]):
    """An array of a picture, shape (height, width, 3), or of an animation, frames first.

    Floats are linear Rec. 709 RGB, bytes are display values. It is an array in all ways; what has
    another shape, such as a row of it, is shown as numbers.
    """

    @classmethod
    def of(cls, pixels: npt.ArrayLike) -> Picture:
        """The picture of an array, whose memory it shares."""
        return np.asarray(pixels).view(cls)

    def __array_wrap__(self, array: Any, context: Any = None, return_scalar: bool = False) -> Any:
        """Results that are no picture are plain arrays and numbers."""
        found = np.asarray(array)
        if found.shape == self.shape:
            return found.view(type(self))
        return found[()] if found.ndim == 0 else found

    def displayed(self) -> npt.NDArray[np.uint8]:
        """What a display shows: bytes of the same shape, with a gamma of 2.2."""
        plain = np.asarray(self)
        if plain.dtype == np.uint8:
            return plain
        shown = tone_map(plain.astype(np.float32, copy=False))
        return np.asarray(np.rint(shown * 255.0), np.uint8)

    def save(self, path: PathLike) -> Path:
        """Write it: `.exr` (linear), `.png` or `.jpg`; an animation as `.gif`, `.png` or `.webp`.

        Returns the path. Raises FormatError if the ending is another, or the file cannot be
        written, NacreError if this is no picture.
        """
        from nacre.mitsuba.animation import write_animation
        from nacre.mitsuba.preview import write_bytes, write_image

        self._check()
        if self.ndim == _ANIMATED:
            write_animation(self.displayed(), path)
        elif self.dtype == np.uint8:
            write_bytes(np.asarray(self), path)
        else:
            write_image(np.asarray(self), path)
        return Path(path)

    def _is_picture(self) -> bool:
        return self.ndim in (3, _ANIMATED) and self.shape[-1] == 3 and 0 not in self.shape

    def _check(self) -> None:
        if not self._is_picture():
            raise NacreError(f"a picture has the shape (height, width, 3), not {self.shape}")

    def __repr__(self) -> str:
        if not self._is_picture():
            return repr(np.asarray(self))
        *frames, height, width, _ = self.shape
        count = f"{frames[0]} frames of " if frames else ""
        kind = "display values" if self.dtype == np.uint8 else "linear RGB"
        return f"<Picture, {count}{width} x {height} pixels, {kind}; .save(path) writes it>"

    def _repr_png_(self) -> bytes | None:
        """The picture for notebooks; None where it is none."""
        from PIL import Image

        if not self._is_picture():
            return None
        if self.ndim == _ANIMATED:
            return self._animation()
        stream = io.BytesIO()
        Image.fromarray(self.displayed()).save(stream, "PNG")
        return stream.getvalue()

    def _animation(self) -> bytes:
        with tempfile.TemporaryDirectory() as folder:
            return self.save(Path(folder) / "animation.png").read_bytes()
