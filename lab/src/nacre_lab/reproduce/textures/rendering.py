"""Renderings of textures, measured or decoded at hits, and their times."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from nacre.btf import Btf
from nacre.io.files import digest
from nacre.mitsuba.preview import render_scene
from nacre.mitsuba.textures.plugins import texture_bsdf
from nacre.mitsuba.textures.scene import describe_texture_scene, texture_scale
from nacre.runtime.progress import Progress, silent
from nacre.textures.codecs.codec import TexelCodec
from nacre.textures.height_file import full_depth
from nacre.textures.latent_map import LatentMap
from nacre.workflows.encoding import encode

SIZE = 256
"""Default edge of renderings in pixels."""
SAMPLES = 32
"""Samples per pixel (Rainer et al. 2020, section 5.1)."""
SOURCES = ("mitsuba/**/*.py", "reproduce/textures/rendering.py")
"""Modules that determine renderings."""


@dataclass(frozen=True)
class View:
    """How to show a texture.

    Parameters
    ----------
    shape, light
        Object, and light on it; see :func:`nacre.mitsuba.textures.scene.describe_texture_scene`.
    repeat
        Repetitions of the texture around or along the object.
    size
        Edge of the picture in pixels.
    height_field
        Height field that texels follow, for parallax; the object is smooth if None.
    """

    shape: str = "cylinder"
    light: str = "environment"
    repeat: int = 4
    size: int = SIZE
    height_field: Path | None = None

    def facts(self) -> dict[str, Any]:
        """Everything that determines a picture, JSON-able."""
        facts = asdict(self) | {"samples": SAMPLES}
        if self.height_field is not None:
            facts["height_field"] = digest(self.height_field)
        return facts


class Rendering(NamedTuple):
    """Linear RGB, shape (size, size, 3), and the seconds from the loaded scene to the picture."""

    picture: npt.NDArray[np.float32]
    seconds: float


def rendering(
    texture: Btf, codec: TexelCodec | None, view: View, seed: int, progress: Progress = silent
) -> Rendering:
    """A path-traced object with a texture, encoded and decoded at hits if a codec is given.

    Raises
    ------
    NacreError
        If the codec is for other directions, or decodes only its own.
    """
    shown = texture if codec is None else encoded(texture, codec, progress)
    return render_texture(shown, view, seed, progress)


def encoded(texture: Btf, codec: TexelCodec, progress: Progress = silent) -> LatentMap:
    """The codes of a texture.

    Raises
    ------
    NacreError
        If the codec is for other directions.
    """
    codes = encode(texture, codec, progress=progress).codes
    return LatentMap(codes, codec, texture.wi, texture.wo, "texture")


def decoder_at_hits(codec: TexelCodec) -> Literal["table", "network"]:
    """How to decode at hits: the papers' networks are evaluated, other codecs tabulated."""
    return "network" if codec.hit_form == "network" else "table"


def render_texture(
    shown: Btf | LatentMap, view: View, seed: int, progress: Progress = silent
) -> Rendering:
    """Render the measured texture, interpolated between the nearest directions, or an encoded one.

    The papers' networks are evaluated at every hit.

    Raises
    ------
    NacreError
        If the codec decodes only its own directions, or the height field cannot be read.
    """
    options: dict[str, Any] = {}
    height, width = (
        shown.codes.shape[:2] if isinstance(shown, LatentMap) else (shown.height, shown.width)
    )
    if isinstance(shown, LatentMap):
        options["decoder"] = decoder_at_hits(shown.codec)
    if view.height_field is not None:
        options |= {
            "height_field": str(view.height_field), "depth": full_depth(view.height_field)
        }  # fmt: skip
    to_uv = texture_scale(view.shape, view.repeat, width / height)
    bsdf = texture_bsdf(shown, progress, interpolation="linear", to_uv=to_uv, **options)
    scene = describe_texture_scene(bsdf, view.shape, view.light, (view.size, view.size))
    began = time.monotonic()
    picture = render_scene(
        scene, SAMPLES, seed, lambda part: progress("rendering", round(100 * part), 100, "")
    )
    return Rendering(picture, time.monotonic() - began)
