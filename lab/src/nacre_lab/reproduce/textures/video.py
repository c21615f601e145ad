"""The video of the paper: a plane under a moving point light, measured and decoded."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from nacre.array import Floats
from nacre.btf import Btf
from nacre.color import tone_map
from nacre.figures.page import FAINT, INK, RULE, Bytes, Page, enlarged
from nacre.metrics.temporal import temporal_errors
from nacre.mitsuba.moving_light import light_path
from nacre.mitsuba.textures.scene import facing
from nacre.textures.codecs.codec import TexelCodec
from nacre.workflows.texture_rendering import TextureView
from nacre_lab.reproduce.experiment import Outcome
from nacre_lab.reproduce.tables import scaled
from nacre_lab.reproduce.textures.animation import animation
from nacre_lab.reproduce.textures.materials import Material
from nacre_lab.reproduce.textures.methods import KINDS, Method
from nacre_lab.reproduce.textures.rendering import SOURCES
from nacre_lab.reproduce.textures.study import Study
from nacre_lab.reproduce.textures.table import error_table

VIEW = TextureView(
    shape="plane",
    light="point",
    light_path="around",
    angle=60.0,
    repeat=2,
    size=256,
    spp=16,
    frames=36,
    interpolation="linear",
)
"""What is shown."""
QUICK = replace(VIEW, size=96, spp=4, frames=12)
"""The same, for a first look."""
_SOURCES = (
    *SOURCES,
    *("workflows/texture_rendering.py", "reproduce/textures/animation.py"),
)
_CELL = 256
"""Least number of pixels along the edge of a picture on a page."""
_SIDE, _GAP, _HEAD, _BELOW, _FOOT = 2.0, 0.12, 0.52, 0.26, 0.5
"""Inches: edge of a picture, space between, heights of titles, captions and the last line."""
_BRIGHT, _SHOWN = 99.0, 0.6
"""Percentile of the measured frames shown at a given brightness, if it is darker."""
_DIAL = 0.17
"""Inches: radius of the circle for the hemisphere above the plane."""


@dataclass(frozen=True)
class Column:
    """Pictures of one representation.

    Parameters
    ----------
    title, about
        Above them.
    caption
        Below them.
    pictures
        Linear RGB of every frame, shape (frames, size, size, 3).
    """

    title: str
    about: str
    caption: str
    pictures: Floats


def video(study: Study, methods: Sequence[Method]) -> Outcome:
    """An animation of each unseen texture, measured and decoded by each method.

    Errors are those of :class:`nacre.metrics.temporal.TemporalErrors`: the difference of each
    animation from that of the measured texture, and how much of it flickers.

    Raises
    ------
    NacreError
        If a codec cannot be made, or a texture cannot be read.
    MissingExtraError
        If the renderer is not installed.
    """
    view = QUICK if study.texels is not None else VIEW
    rows: list[Sequence[object]] = []
    errors: dict[str, dict[str, float]] = {}
    flicker: dict[str, dict[str, float]] = {}
    animations = {}
    for material in study.unseen:
        truth = _frames(study, None, material, view)
        assert truth is not None
        columns = [Column("measured", "interpolated between directions", "", truth)]
        for method in methods:
            pictures = _frames(study, method, material, view)
            if pictures is None:
                continue
            found = temporal_errors(zip(truth, pictures, strict=True))
            numbers = found.mse, found.variance, found.error_steps, found.truth_steps
            rows.append((material.name, method.name, *numbers, found.other_steps))
            errors.setdefault(method.name, {})[material.name] = found.mse
            flicker.setdefault(method.name, {})[material.name] = found.error_steps
            caption = f"MSE x 10⁴ {scaled(found.mse)}"
            columns.append(Column(method.name, KINDS[method.kind].about, caption, pictures))
        animations[material.name] = list(video_frames(material.name, columns, view))
    names = [material.name for material in study.unseen]
    text = (
        f"Of renderings, clipped to [0, 1]:\n\n{error_table(names, errors)}\nOf the change of the "
        f"difference from each frame to the next:\n\n{error_table(names, flicker)}"
    )
    head = "material", "method", "mse", "variance", "error_steps", "truth_steps", "other_steps"
    return Outcome({}, head, rows, text, animations=animations)


def _frames(
    study: Study, method: Method | None, material: Material, view: TextureView
) -> Floats | None:
    """Frames of the measured or decoded texture; None if the method does not suit it."""

    def make(
        texture: Btf, codec: TexelCodec | None, view: TextureView, seed: int
    ) -> dict[str, npt.NDArray[np.float16]]:
        return {"frames": animation(texture, codec, view, seed, study.report(method, material))}

    found = study.results("animation", ("frames",), make, method, material, view, sources=_SOURCES)
    return None if found is None else found["frames"]


def video_frames(name: str, columns: Sequence[Column], view: TextureView) -> Iterator[Bytes]:
    """Pages of an animation: columns side by side, and a dial with the position of the light.

    Parameters
    ----------
    name
        Name of the texture.
    columns
        From left to right; the first determines the brightness of all.
    view
        The view; a light moving over a plane.
    """
    assert view.frames is not None
    directions = light_path(view.light_path or "around", view.frames, view.angle, view.shape)
    normal = np.array(facing(view.shape))
    right = np.array([1.0, 0.0, 0.0])
    above = np.cross(normal, right)
    width = len(columns) * (_SIDE + _GAP) + _GAP
    cell = max(_CELL, view.size)
    exposure = max(1.0, _SHOWN / max(float(np.percentile(columns[0].pictures, _BRIGHT)), 1e-6))
    for index, toward in enumerate(directions):
        page = Page(width, _HEAD + _SIDE + _BELOW + _FOOT, dpi=cell / _SIDE)
        for k, column in enumerate(columns):
            x = _GAP + k * (_SIDE + _GAP)
            page.text(x, 0.24, column.title, 10.0, weight="bold", limit=_SIDE)
            page.text(x, 0.42, column.about, 6.4, FAINT, limit=_SIDE)
            shown = tone_map(exposure * column.pictures[index].astype(np.float32))
            page.image(x, _HEAD, _SIDE, _SIDE, enlarged(shown, cell), smooth=False)
            page.text(x, _HEAD + _SIDE + 0.06, column.caption, 8.0, va="top", limit=_SIDE)
        y = _HEAD + _SIDE + _BELOW + 0.5 * _FOOT
        steep = np.degrees(np.arccos(np.clip(toward @ normal, -1.0, 1.0)))
        words = f"{name}, a point light {steep:.0f}° from the normal, exposed {exposure:.2g} times"
        page.text(_GAP, y, words, 8.0, va="center", limit=width - 4 * _GAP - 2 * _DIAL)
        dial = width - _GAP - _DIAL
        page.ring(dial, y, _DIAL, RULE)
        page.ring(dial + _DIAL * (toward @ right), y - _DIAL * (toward @ above), 0.012, INK)
        yield page.pixels()
