"""What Mitsuba's films hold: pictures of any channels, and the colors among them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from nacre.array import Floats, Image
from nacre.color import luminance, rgb_to_xyz, xyz_to_rgb
from nacre.errors import NacreError
from nacre.io.files import PathLike
from nacre.io.image_file import write_exr
from nacre.mitsuba.engine import mitsuba
from nacre.mitsuba.preview import check_image_path, write_image

_SPACES = {"R": ("R", "G", "B"), "X": ("X", "Y", "Z"), "Y": ("Y",)}
"""The channels that a film's colors begin with, by the first."""


_BANDS = "SpecFilm"
_NO_COLORS = "which are no colors: write an .exr, or make it an hdrfilm"


def check_colors(film: Any) -> None:
    """Raise NacreError if a film does not hold colors; call it before a long rendering."""
    if film.class_name() == _BANDS:
        raise NacreError(f"the scene's film holds bands, {_NO_COLORS}")


@dataclass(frozen=True, eq=False)
class FilmPicture:
    """A picture as a film holds it.

    Parameters
    ----------
    values
        Shape (height, width, channels).
    names
        Of the channels, as in Mitsuba's own OpenEXR files.
    pixel_format
        Mitsuba's name of how the channels make a pixel: "RGB", "XYZA", "MultiChannel", ...
    components
        Mitsuba's name of what an OpenEXR file holds: "Float16", "Float32" or "UInt32".
    kind
        Class of the film: "HDRFilm", or "SpecFilm", which has bands in place of colors.
    """

    values: Image
    names: tuple[str, ...]
    pixel_format: str
    components: str
    kind: str = "HDRFilm"

    @classmethod
    def of(cls, film: Any, bitmap: Any, values: Floats) -> FilmPicture:
        """The picture of some values, which have the channels of a film's bitmap."""
        found = re.search(r"component_format = (\w+)", str(film))
        stored = {"float16": "Float16", "uint32": "UInt32"}
        return cls(
            values.astype(np.float32),
            tuple(field.name for field in bitmap.struct_()),
            bitmap.pixel_format().name,
            stored.get(found[1], "Float32") if found else "Float32",
            film.class_name(),
        )

    @property
    def colors(self) -> Image:
        """Linear Rec. 709 RGB, shape (height, width, 3); raises NacreError if there is none."""
        base = self._base()
        found = self.values[..., : len(base)]
        if base[0] == "X":
            return xyz_to_rgb(found).astype(np.float32)
        return np.repeat(found, 3, axis=-1) if base[0] == "Y" else found

    def with_colors(self, rgb: Image) -> FilmPicture:
        """The picture with other colors, linear Rec. 709 RGB; other channels stay."""
        base = self._base()
        own: Any = rgb
        if base[0] == "X":
            own = rgb_to_xyz(rgb)
        elif base[0] == "Y":
            own = np.asarray(luminance((rgb[..., 0], rgb[..., 1], rgb[..., 2])))[..., None]
        values = self.values.copy()
        values[..., : len(base)] = own
        return replace(self, values=values)

    def channels(self, names: Sequence[str]) -> Image | None:
        """Some channels, stacked along the last axis; None if one is not there."""
        if not set(names) <= set(self.names):
            return None
        return self.values[..., [self.names.index(name) for name in names]]

    def write(self, path: PathLike) -> None:
        """Write an `.exr` as Mitsuba does, with all channels, or the colors as `.png` or `.jpg`.

        Raises FormatError if the ending is none of these or the file cannot be written; NacreError
        if there are no colors to write.
        """
        path = check_image_path(path)
        if path.suffix.lower() == ".exr":
            self._write_channels(path)
        else:
            write_image(self.colors, path)

    def _base(self) -> tuple[str, ...]:
        base = _SPACES.get(self.names[0], ()) if self.kind != _BANDS else ()
        if not base or self.names[: len(base)] != base:
            raise NacreError(f"the scene's film holds {', '.join(self.names)}, {_NO_COLORS}")
        return base

    def _write_channels(self, path: Path) -> None:
        mi = mitsuba()
        pixels, component = mi.Bitmap.PixelFormat, mi.Struct.Type[self.components]
        height, width, count = self.values.shape
        # Mitsuba converts bitmaps of many channels to "ch0", "ch1", ...: convert one of a channel.
        flat = mi.Bitmap(np.ascontiguousarray(self.values.reshape(height, width * count)), pixels.Y)
        names = list(self.names) if self.pixel_format == "MultiChannel" else []
        bitmap = mi.Bitmap(pixels[self.pixel_format], component, [width, height], count, names)
        held = np.array(bitmap, copy=False)
        held[...] = np.array(flat.convert(pixels.Y, component, False)).reshape(held.shape)
        write_exr(bitmap, path)
