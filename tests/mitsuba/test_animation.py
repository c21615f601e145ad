"""Animations: what is in the file, as Pillow reads it, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from nacre.errors import FormatError, NacreError
from nacre.mitsuba.animation import (
    FRAME_MILLISECONDS,
    MAX_PIXELS,
    check_animation,
    write_animation,
)

COLOURS = np.array([[200, 30, 40], [20, 180, 60], [10, 90, 220], [240, 240, 10]], np.uint8)


def moving(count: int) -> list[np.ndarray]:
    """A square of four colors before a slope of grays, further to the right in each frame."""
    frames = []
    for index in range(count):
        frame = np.repeat(np.linspace(0, 255, 24).astype(np.uint8)[:, None, None], 40, 1)
        frame = np.repeat(frame, 3, 2)
        frame[4:12, 3 * index : 3 * index + 8] = COLOURS[(np.arange(8) // 2)][:, None]
        frames.append(frame)
    return frames


@pytest.mark.parametrize(("ending", "tolerance"), [(".png", 0), (".gif", 1), (".webp", 8)])
def test_frames_come_back_in_order_and_repeat(tmp_path: Path, ending: str, tolerance: int) -> None:
    frames = np.array(moving(5), int)
    path = tmp_path / f"moving{ending}"
    write_animation(iter(frames.astype(np.uint8)), path)
    with Image.open(path) as animation:
        assert (animation.n_frames, animation.size, animation.info["loop"]) == (5, (40, 24), 0)
        for index in range(5):
            animation.seek(index)
            read = np.array(animation.convert("RGB"), int)
            assert animation.info["duration"] == FRAME_MILLISECONDS
            errors = np.abs(frames - read).mean((1, 2, 3))
            assert np.argmin(errors) == index
            assert errors[index] <= tolerance
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]


def test_what_stands_still_has_the_same_colors_in_all_frames_of_a_gif(tmp_path: Path) -> None:
    frames = [np.full((8, 8, 3), 90, np.uint8) for _ in range(4)]
    for index, frame in enumerate(frames):
        frame[:, 4:] = np.random.default_rng(index).integers(0, 256, (8, 4, 3))
    write_animation(frames, tmp_path / "half.gif")
    with Image.open(tmp_path / "half.gif") as animation:
        still = []
        for index in range(animation.n_frames):
            animation.seek(index)
            still.append(np.array(animation.convert("RGB"))[:, :4])
    assert len(still) == 4
    np.testing.assert_array_equal(still, np.broadcast_to(still[0], np.shape(still)))


def test_what_cannot_be_an_animation_is_refused() -> None:
    for name in ("a.mp4", "a.jpg", "a.exr", "a"):
        with pytest.raises(FormatError, match=r"ends in one of \.gif, \.png, \.webp"):
            check_animation(name, 2, 8, 8)
    check_animation("a.gif", MAX_PIXELS // 64, 8, 8)
    with pytest.raises(NacreError, match=r"make fewer or smaller"):
        check_animation("a.gif", MAX_PIXELS // 64 + 1, 8, 8)
    with pytest.raises(FormatError, match=r"choose \.gif or \.png"):
        check_animation("a.webp", 2, 20_000, 8)
