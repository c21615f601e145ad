"""Textures of the UTIA BTF database: folders of images named by their directions.

Filip, Vavra and Haindl, http://btf.utia.cas.cz/?data_des: `tl015_pl060_tv030_pv000.png` has the
light at a polar angle of 15 and an azimuth of 60 degrees and the view at 30 and 0; the images of
one view lie in a folder `tv030_pv000`. That is how the database of Bonn of 2003 named them too.
Images are 8 bit sRGB (`.png`), or OpenEXR of halves in CIE XYZ with white D65. There are 81 x 81 of
them (:data:`nacre.measured.textures.domes.UTIA`).

Where light and view would coincide, the light was moved a little. The database has a list of where
to; the file names do not say, so such pairs are taken for what their names say. Nor does it say
what value stands for white: pixels are taken for reflectance factors unless stated otherwise.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np

from nacre.errors import FormatError
from nacre.io.files import PathLike
from nacre.io.format import Format
from nacre.measured.textures.directions import (
    PAIR_LIMIT,
    check_directions,
    check_distinct,
    from_degrees,
)
from nacre.measured.textures.image_folder import ImageFolderBtf, Quantity

_IMAGE = re.compile(
    r"tl([0-9]{3})_pl([0-9]{3})_tv([0-9]{3})_pv([0-9]{3})\.(?:png|exr)", re.IGNORECASE
)
_VIEW = re.compile(r"tv([0-9]{3})_pv([0-9]{3})", re.IGNORECASE)

_Degrees = tuple[int, ...]


def load(path: PathLike, quantity: Quantity = "reflectance") -> ImageFolderBtf:
    """Read a folder of the UTIA BTF database, or any other with such names, whose name becomes the
    material's.

    Images lie in the folder, or in folders of views. The pairs of directions are those that have
    images, by view, then by light; other files do not matter. A FormatError says that the folder
    cannot be read, has no such image, or two of one pair of directions, or one in the folder of
    another view or below the horizon, or that images differ in size.
    """
    path = Path(path)
    try:
        found = sorted(_images(path), key=lambda item: (item[0][2:], item[0][:2], item[1]))
    except OSError as error:
        raise FormatError(f"{error.filename or path}: cannot be read: {error.strerror}") from error
    if not found:
        raise FormatError(f"{path}: has no image with a name like tl000_pl000_tv000_pv000.png")
    degrees, files = np.array([angles for angles, _ in found]), [file for _, file in found]
    names = [file.name for file in files]
    wi, wo = (
        check_directions(from_degrees(*degrees[:, part].T), f"{path}: {what}", names)
        for part, what in ((slice(0, 2), "lights"), (slice(2, 4), "views"))
    )
    check_distinct(wi, wo, names, str(path))
    return ImageFolderBtf(files, wi, wo, path.resolve().name, [quantity] * len(files))


def _images(folder: Path) -> Iterator[tuple[_Degrees, Path]]:
    """Angles in degrees, (theta, phi) of light and view, and paths of the images in a folder."""
    count = 0
    with os.scandir(folder) as entries:
        for entry in entries:
            view = _VIEW.fullmatch(entry.name)
            within = view is not None and entry.is_dir()
            for file in Path(entry.path).iterdir() if within else (folder / entry.name,):
                match = _IMAGE.fullmatch(file.name)
                if not match:
                    continue
                angles = _angles(match)
                if view and angles[2:] != _angles(view):
                    raise FormatError(f"{file}: lies in the folder of another view")
                count += 1
                if count > PAIR_LIMIT:
                    raise FormatError(f"{folder}: has more than {PAIR_LIMIT} images")
                yield angles, file


def _angles(match: re.Match[str]) -> _Degrees:
    return tuple(map(int, match.groups()))


def _is_folder(path: Path) -> bool:
    with suppress(OSError), os.scandir(path) as entries:
        return any(_IMAGE.fullmatch(e.name) or _VIEW.fullmatch(e.name) for e in entries)
    return False


FORMAT = Format("UTIA BTF folder", (), None, load, kind="btf", claims_folder=_is_folder)
