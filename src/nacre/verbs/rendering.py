"""`nacre.render`: a picture of a material on an object, or of a scene."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.errors import FormatError, NacreError
from nacre.formats import describe_kind
from nacre.io.files import PathLike
from nacre.mitsuba.environment import Environment, load_environment
from nacre.runtime.progress import Progress, silent
from nacre.verbs.material import Given, closest, opened, path_of
from nacre.verbs.picture import Picture


def render(
    material: Given,
    shape: str | None = None,
    light: str | None = None,
    *,
    environment: Environment | PathLike | None = None,
    size: int | None = None,
    height: int | None = None,
    spp: int | None = None,
    denoise: bool | None = None,
    seed: int = 0,
    angle: float | None = None,
    repeat: int | None = None,
    frames: int | None = None,
    light_path: str | None = None,
    decode: str | None = None,
    interpolation: str | None = None,
    mipmap: bool | None = None,
    height_field: PathLike | None = None,
    depth: float | None = None,
    define: Mapping[str, object] | None = None,
    sensor: int | str | None = None,
    variant: str | None = None,
    progress: Progress | None = None,
) -> Picture:
    """Render a material by path tracing: a reflectance or a texture, or a Mitsuba scene.

    Parameters
    ----------
    material
        A material, its path, the name of one that comes with nacre, or a scene file (`.xml`), which
        has its own objects, lights, size and samples.
    shape
        Object to show: "ball" or "sphere"; for a texture "cylinder", "sphere", "plane" or "ground".
        The first by default.
    light
        "environment" (default) or "directional"; for a texture also "point".
    environment
        Latitude-longitude map: a path (`.exr`, `.hdr`, `.png`), or what
        :func:`nacre.mitsuba.environment.load_environment` returns; a built-in studio where None.
    size
        Width of the picture in pixels; 512 by default, or a scene's own.
    height
        Height in pixels, not for textures; by default the width, or in the proportions of a scene.
    spp
        Samples per pixel: 24 by default, 40 without the denoiser, 64 for textures without it.
    denoise
        Remove noise where the denoiser is installed; by default true, but not for animations and
        scenes.
    seed
        Of the samples.
    angle, repeat, frames, light_path, decode, interpolation, mipmap, height_field, depth
        For textures, see `nacre help render`: `angle` of the light in degrees, `repeat` times
        around the object, `frames` of an animation, ...
    define, sensor, variant
        For scenes: values of parameters in place of those of its `<default>`s, number or id of the
        sensor to render, variant of Mitsuba for this picture.
    progress
        Called as the work goes on.

    Returns
    -------
    Picture
        Linear Rec. 709 RGB, float32, shape (height, width, 3); with `frames` shape (frames, size,
        size, 3), half precision. Notebooks show it; `.save("a.png")` writes it.

    Raises
    ------
    NacreError
        If the material cannot be read or rendered in this way, or an option is for another kind.
    MissingExtraError
        If Mitsuba is not installed.

    Examples
    --------
    >>> import nacre
    >>> nacre.render("rgl:paper_white", size=8, spp=1, denoise=False)
    <Picture, 8 x 8 pixels, linear RGB; .save(path) writes it>
    """
    common: dict[str, Any] = {"shape": shape, "light": light, "environment": environment}
    common |= {"size": size, "denoise": denoise}
    of_texture = {
        "angle": angle,
        "repeat": repeat,
        "frames": frames,
        "light_path": light_path,
        "decode": decode,
        "interpolation": interpolation,
        "mipmap": mipmap,
        "height_field": height_field,
        "depth": depth,
    }
    of_scene = {"define": define, "sensor": sensor, "variant": variant}
    path, report = path_of(material), progress or silent
    if path is not None and path.suffix.lower() == ".xml" and not describe_kind(path):
        material_only = {"shape": shape, "light": light, "environment": environment}
        _refuse({**material_only, **of_texture}, f"{path} is a scene")
        return _scene(path, {**common, "height": height, **of_scene}, spp, seed, report)
    found = opened(material)
    name = found.name or "this material"
    _refuse(of_scene, f"{name} is a material")
    if isinstance(found, Brdf):
        _refuse(of_texture, f"{name} is a reflectance")
        return _reflectance(found, {**common, "height": height}, spp, seed, report)
    _refuse({"height": height}, f"{name} is a texture, shown in a square")
    return _texture(found, {**common, **of_texture, "spp": spp, "seed": seed}, report)


def lighting(environment: Environment | PathLike | None) -> Environment | None:
    """The environment that was given, read if it is a path."""
    if environment is None or isinstance(environment, Environment):
        return environment
    return load_environment(environment)


def _reflectance(
    brdf: Brdf, given: dict[str, Any], spp: int | None, seed: int, progress: Progress
) -> Picture:
    from nacre.mitsuba.preview import default_spp, render_preview
    from nacre.mitsuba.scene import LIGHTS, SHAPES

    _check("shape", given["shape"], SHAPES)
    _check("light", given["light"], LIGHTS)
    clean = given["denoise"] is not False
    samples = default_spp(clean) if spp is None else spp
    width = 512 if given["size"] is None else given["size"]
    height = width if given["height"] is None else given["height"]
    picture = render_preview(
        brdf,
        given["shape"] or SHAPES[0],
        given["light"] or LIGHTS[0],
        (width, height),
        samples,
        seed,
        lighting(given["environment"]),
        _parts(progress, samples),
        clean,
    )
    return Picture.of(picture)


def _texture(texture: Btf, given: dict[str, Any], progress: Progress) -> Picture:
    from nacre.mitsuba.preview import default_spp
    from nacre.mitsuba.textures.scene import GEOMETRIES, LIGHTS
    from nacre.workflows.texture_rendering import TEXTURE_SPP, TextureView, texture_pictures

    _check("shape", given["shape"], GEOMETRIES)
    _check("light", given["light"], LIGHTS)
    frames = given["frames"]
    if frames and given["denoise"]:
        raise NacreError("denoise is for pictures, not for animations; leave it out")
    if frames and given["light"] not in ("directional", "point"):
        raise NacreError('frames show a moving light; add light="directional" or light="point"')
    clean = given["denoise"] is not False and not frames
    settings = {
        **{name: value for name, value in given.items() if value is not None},
        "denoise": clean,
        "environment": lighting(given["environment"]),
        "spp": default_spp(clean, TEXTURE_SPP) if given["spp"] is None else given["spp"],
    }
    if "decode" in settings:
        settings["decoder"] = settings.pop("decode")
    if "height_field" in settings:
        settings["height_field"] = Path(settings["height_field"])
    pictures = list(texture_pictures(texture, TextureView(**settings), progress))
    return Picture.of(np.stack(pictures) if frames else pictures[0])


def _scene(
    path: Path, given: dict[str, Any], spp: int | None, seed: int, progress: Progress
) -> Picture:
    from nacre.mitsuba.scene_rendering import render_file

    picture = render_file(
        path,
        spp,
        seed,
        _parts(progress, spp or 100),
        parameters={name: str(value) for name, value in (given["define"] or {}).items()},
        variant=given["variant"],
        sensor=given["sensor"],
        width=given["size"],
        height=given["height"],
        denoise=bool(given["denoise"]),
    )
    return Picture.of(picture)


def _parts(progress: Progress, total: int) -> Any:
    return lambda part: progress("rendering", round(part * total), total, "")


def _check(what: str, name: str | None, known: tuple[str, ...]) -> None:
    if name is None or name in known:
        return
    if Path(name).suffix:
        raise FormatError(
            f"{name!r} is no {what}; to write the picture: nacre.render(...).save({name!r})"
        )
    raise NacreError(f"{name!r} is no {what} here{closest(name, known)}")


def _refuse(given: dict[str, Any], why: str) -> None:
    """Raise if an option for another kind of input is given."""
    for name, value in given.items():
        if value is not None:
            raise NacreError(f"{name} cannot be used here: {why}")
