"""Pictures and animations of textures on objects, alone or beside a reference."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from nacre.errors import NacreError
from nacre.io.files import PathLike
from nacre.mitsuba.environment import Environment
from nacre.runtime.progress import Progress, silent
from nacre.runtime.store import Store

if TYPE_CHECKING:
    from nacre.array import Floats
    from nacre.btf import Btf
    from nacre.figures.page import Bytes
    from nacre.metrics.temporal import TemporalErrors


TEXTURE_SPP = 64
"""Samples per pixel for a texture without denoising."""


@dataclass(frozen=True)
class TextureView:
    """How to show a texture; the fields are the options of `nacre render`."""

    shape: str = "cylinder"
    light: str = "environment"
    environment: Environment | None = None  # the built-in one if None
    angle: float = 45.0  # degrees between the view and a directional or point light
    repeat: int = 4  # times around the object
    size: int = 512  # width and height of a picture in pixels
    spp: int = TEXTURE_SPP
    seed: int = 0
    denoise: bool = False  # if the denoiser is installed
    frames: int | None = None  # of an animation; a picture if None
    light_path: str | None = None
    decoder: str = "table"
    interpolation: str = "stochastic"
    mipmap: bool = False
    height_field: Path | None = None  # gray image for parallax
    depth: float | None = None  # in widths of the texture; nacre.textures.height_file.full_depth


@dataclass(frozen=True)
class RenderedTexture:
    """Size in pixels of a picture or animation, and its errors against the reference, if any."""

    width: int
    height: int
    mse: float | None = None  # mean squared error, including noise
    temporal: TemporalErrors | None = None  # from frame to frame of an animation


def check_texture_view(output: PathLike, view: TextureView, *, compared: bool = False) -> None:
    """Raise a NacreError before the work if options conflict, or the output is not a picture."""
    from nacre.figures.difference_sheet import panels_size
    from nacre.mitsuba.animation import check_animation
    from nacre.mitsuba.preview import check_image_path

    if view.frames is None:
        if view.light_path is not None:
            raise NacreError("a light path is for an animation; add frames (--frames)")
        check_image_path(output)
        return
    if view.light == "environment":
        raise NacreError(
            "frames show a moving light; choose a directional or point light (--light)"
        )
    size = panels_size(view.size) if compared else (view.size, view.size)
    check_animation(Path(output), view.frames, *size)


def render_texture(
    texture: Btf,
    output: PathLike,
    view: TextureView | None = None,
    *,
    reference: Btf | None = None,
    names: tuple[str, str] = ("Reference", "Model"),
    start: Callable[[str], Progress] = lambda name: silent,
    store: Store | None = None,
) -> RenderedTexture:
    """Render a measured or encoded texture to a picture or an animation.

    Parameters
    ----------
    output
        `.exr`, `.png` or `.jpg`; for an animation `.gif`, `.png` or `.webp`.
    reference
        A texture to show in the same way on the left; errors are on the right, except in `.exr`.
    names
        Captions of the reference and of the texture.
    start
        Called with the name of each texture; the result is called with the progress.
    store
        Keeps pictures so far, for another process to go on; frames are not kept.

    Raises
    ------
    NacreError
        If :func:`check_texture_view` fails, or the texture cannot be rendered in this way.
    """
    from nacre.color import tone_map
    from nacre.figures.difference_sheet import panels_size, rendering_panels
    from nacre.figures.page import display_bytes
    from nacre.metrics.temporal import temporal_errors
    from nacre.mitsuba.animation import write_animation
    from nacre.mitsuba.preview import write_bytes, write_image

    view, output = view or TextureView(), Path(output)
    check_texture_view(output, view, compared=reference is not None)
    shown = list(texture_pictures(texture, view, start(texture.name), store))
    expected = []
    if reference is not None:
        report = start(reference.name)
        expected = list(texture_pictures(reference, view, report, store, "reference"))
    width = height = view.size
    pages: Iterable[Bytes] = (display_bytes(tone_map(picture)) for picture in shown)
    mse = temporal = None
    if reference is not None:
        errors = temporal_errors(zip(expected, shown, strict=True))
        mse, temporal = errors.mse, errors if view.frames else None
        width, height = panels_size(view.size)
        facts = f"{view.spp} samples per pixel, {error_text(mse)}"
        pages = rendering_panels(expected, shown, names, facts)
    if output.suffix.lower() == ".exr":
        values = np.concatenate([*expected, *shown], axis=1)
        height, width = values.shape[:2]
        write_image(values, output)
    elif view.frames is None:
        (page,) = pages
        write_bytes(page, output)
    else:
        write_animation(pages, output)
    return RenderedTexture(width, height, mse, temporal)


def error_text(mse: float) -> str:
    """The mean squared error of a rendering, as text."""
    return f"MSE x 1e4 {1e4 * mse:.3g}, noise included"


def texture_pictures(
    btf: Btf,
    view: TextureView,
    report: Progress = silent,
    store: Store | None = None,
    name: str = "",
) -> Iterator[Floats]:
    """Render a texture to one picture, or to the frames of an animation.

    Yields
    ------
    array of shape (size, size, 3)
        Linear Rec. 709 RGB; frames of an animation are clipped to [0, 1], in half precision.

    Raises
    ------
    NacreError
        If the texture cannot be rendered in this way.
    """
    from nacre.mitsuba.moving_light import PATHS, light_path, render_moving
    from nacre.mitsuba.preview import render_scene
    from nacre.mitsuba.textures.plugins import texture_bsdf
    from nacre.mitsuba.textures.scene import describe_texture_scene, pixel_angle, texture_scale
    from nacre.textures.height_file import full_depth

    size = view.size, view.size
    options: dict[str, Any] = {"interpolation": view.interpolation}
    if view.height_field is not None:
        depth = full_depth(view.height_field) if view.depth is None else view.depth
        options |= {"height_field": str(view.height_field), "depth": depth}
    if btf.latent is not None:
        options |= {"decoder": view.decoder}
        options |= {"pixel_angle": pixel_angle(size)} if view.mipmap else {}
    bsdf = texture_bsdf(
        btf if btf.latent is None else btf.latent,
        report,
        **options,
        to_uv=texture_scale(view.shape, view.repeat, btf.width / btf.height),
    )
    total = view.frames or view.spp
    report("rendering", 0, total, "")

    def progress(part: float) -> None:
        report("rendering", round(part * total), total, "")

    way = view.light_path or PATHS[0]
    standing = view.frames is None or way != "around"
    scene = describe_texture_scene(
        bsdf, view.shape, view.light, size, view.angle, view.environment, standing=standing
    )
    if view.frames is None:
        yield render_scene(scene, view.spp, view.seed, progress, view.denoise, store, name)
        return
    directions = light_path(way, view.frames, view.angle, view.shape)
    for picture in render_moving(scene, directions, view.spp, view.seed, progress):
        yield np.clip(picture, 0.0, 1.0).astype(np.float16)  # finer than a display
