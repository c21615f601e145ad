"""Folders of images that tests of several readers make, and a texture that stands for one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from nacre.btf import Btf, Indices, TableBtf
from nacre.errors import FormatError
from nacre.textures.codecs.codec import TrainingRun

WIDTH, HEIGHT = 7, 5


def pixels(seed: int, dtype: str = "u1") -> npt.NDArray[Any]:
    """Random pixels, of bytes or of floats up to 2."""
    random = np.random.default_rng(seed)
    if dtype == "u1":
        return random.integers(0, 256, (HEIGHT, WIDTH, 3), "u1")
    return (2.0 * random.random((HEIGHT, WIDTH, 3))).astype(dtype)


def write_image(path: Path, image: npt.NDArray[Any]) -> Path:
    """Bytes by Pillow, floats by Mitsuba."""
    path.parent.mkdir(exist_ok=True)
    if image.dtype == np.uint8:
        from PIL import Image

        Image.fromarray(image).save(path, quality=95)
    else:
        import mitsuba as mi

        mi.Bitmap(image).write(str(path))
    return path


def linear(image: npt.NDArray[np.uint8]) -> npt.NDArray[np.float32]:
    """Bytes of sRGB as Mitsuba decodes them, which is not ours."""
    import mitsuba as mi

    bitmap = mi.Bitmap(np.ascontiguousarray(image))
    bitmap.set_srgb_gamma(True)
    return np.array(bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))


class ByImage(TableBtf):
    """A texture that may be read by image only, and notes the pairs of those that were."""

    by_image = True

    def __init__(self, made: TableBtf) -> None:
        super().__init__(made.values, made.wi, made.wo, made.name)
        self.read: list[int] = []

    def texels(self, chosen: Indices | slice) -> npt.NDArray[np.float32]:
        raise AssertionError("reads every image")

    def images(self, chosen: Indices | slice) -> npt.NDArray[np.float32]:
        self.read.extend(np.arange(self.pair_count)[chosen].tolist())
        return super().images(chosen)


def assert_refused(read: Callable[[], Any], *parts: str) -> None:
    """One line that says what is wrong."""
    with pytest.raises(FormatError) as caught:
        read()
    message = str(caught.value)
    assert "\n" not in message
    for part in parts:
        assert part in message


def run_of(textures: Sequence[Callable[[], Btf]], **others: Any) -> TrainingRun:
    """A training on textures that are made when they are opened."""
    return TrainingRun(
        [f"made{index}" for index in range(len(textures))],
        lambda path: textures[int(str(path).removeprefix("made"))](),
        **others,
    )
