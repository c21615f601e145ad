"""Pictures: of materials, of heights, and of textures in folders."""

from __future__ import annotations

import io
import shutil
from collections.abc import Callable
from pathlib import Path
from random import Random

import numpy as np

from nacre.io.image_file import PIXEL_LIMIT
from nacre.measured.textures import utia_folder
from nacre.measured.textures.photographs import load_photographs
from nacre.photographs.estimate import read_photographs
from nacre.textures.height_file import read_heights
from tests.fuzz.damage import words_damage
from tests.fuzz.families import light
from tests.fuzz.readers import reader
from tests.reading import check_texture
from tests.specimens.images import png_bytes
from tests.specimens.specimen import mutated

_PIXELS = np.arange(4 * 8 * 3, dtype="u1").reshape(4, 8, 3)
_LIST = b"file,theta_l,phi_l,theta_v,phi_v\na.jpg,0,0,30,90\n"


def _read_photograph(path: Path) -> None:
    (picture,) = read_photographs([path])
    assert picture.dtype == np.float32
    assert picture.shape[2] == 3


def _read_heights(path: Path) -> None:
    heights = read_heights(path)
    assert heights.ndim == 2
    assert np.isfinite(heights).all()


def _jpegs() -> list[bytes]:
    from PIL import Image

    found = []
    for options in ({}, {"progressive": True}, {"subsampling": 0, "restart_marker_blocks": 1}):
        stream = io.BytesIO()
        Image.fromarray(_PIXELS).save(stream, "JPEG", **options)
        found.append(stream.getvalue())
    return found


def _jpeg_damage(data: bytes, random: Random) -> bytes:
    """Segments in another order, twice, or missing, of which one is damaged."""
    parts = random.choice(_jpegs()).split(b"\xff")
    for _ in range(random.choice((1, 1, 2))):
        place = random.randrange(1, len(parts))
        choice = random.random()
        if choice < 0.25:
            del parts[place]
        elif choice < 0.5:
            parts.insert(place, random.choice(parts))
        else:
            parts[place] = mutated(parts[place], random)
    return b"\xff".join(parts)


def _read_list(path: Path) -> None:
    check_texture(load_photographs(path.parent))


def _read_folder(path: Path) -> None:
    check_texture(utia_folder.load(path.parent))


_NAMES = (
    b"tl000_pl000_tv000_pv000.png\ntl015_pl060_tv000_pv000.png\n",
    b"tv030_pv000/tl015_pl060_tv030_pv000.png\ntv030_pv000/tl030_pl060_tv030_pv000.PNG\n",
)
_WORDS = (
    *("tl000_pl000_tv000_pv000.png", "tv030_pv000/", "tv030_pv000.png", "tl090_pl000_tv000_pv000"),
    *("999", "075", ".exr", "tl٣٣٣_pl000_tv000_pv000.png", "\n", "/", ".png", "TL000_PL000"),
)


def _read_names(path: Path) -> None:
    """A folder of pictures with the names that a file lists."""
    folder, whole = path.with_name("folder"), png_bytes(_PIXELS, 8, 4)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    try:
        for name in path.read_bytes().decode("utf-8", "replace").split("\n")[:20]:
            parts = name.split("/")
            plain = all(part not in ("", ".", "..") and len(part) < 80 for part in parts)
            file = folder / name.replace("\0", "")
            if not plain or len(parts) > 2 or file.exists() or file.parent.is_file():
                continue
            file.parent.mkdir(exist_ok=True)
            file.write_bytes(whole)
        check_texture(utia_folder.load(folder))
    finally:
        shutil.rmtree(folder)


def _names() -> list[bytes]:
    return [*_NAMES]


_exr: Callable[[bytes, Random], bytes] = light.image_damage(light.exr_files, ".exr")
_png: Callable[[bytes, Random], bytes] = light.image_damage(light.png_files, ".png")
_NAME = "tl000_pl000_tv000_pv000"

READERS = (
    reader("photograph", "a.exr", light.exr_files, _exr, _read_photograph, memory=64 << 20),
    reader("heights (.exr)", "a.exr", light.exr_files, _exr, _read_heights, memory=64 << 20),
    reader("heights (.png)", "a.png", light.png_files, _png, _read_heights, memory=64 << 20),
    reader(
        "photograph (.jpg)", "a.jpg", _jpegs, _jpeg_damage, _read_list,
        companions={"directions.csv": _LIST}, memory=64 << 20,
    ),
    reader(
        "picture of a UTIA folder (.png)", f"{_NAME}.png", light.png_files, _png, _read_folder,
        memory=64 << 20,
    ),
    reader(
        "picture of a UTIA folder (.exr)", f"{_NAME}.exr", light.exr_files, _exr, _read_folder,
        memory=16 * PIXEL_LIMIT,
    ),
    reader(
        "names of a UTIA folder", "names.txt", _names, words_damage(_names, _WORDS), _read_names,
        memory=64 << 20, writes=True,
    ),
)  # fmt: skip
