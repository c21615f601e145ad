"""Scenes in Mitsuba's XML: read with the plugins of this package registered, and rendered."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from nacre.array import Image
from nacre.errors import FormatError, NacreError, is_shortage
from nacre.io.files import PathLike
from nacre.render.engine import mitsuba
from nacre.render.plugins import register
from nacre.render.preview import render_scene
from nacre.render.scene_guard import check_scene


def render_file(
    path: PathLike,
    spp: int | None = None,
    seed: int = 0,
    progress: Callable[[float], None] | None = None,
) -> Image:
    """Render a scene file, with the plugins `nbrdf`, `brdf`, `neuralbtf` and `measuredbtf`.

    Parameters
    ----------
    path
        A Mitsuba scene (`.xml`); files that it names are found beside it. Its first sensor is
        rendered.
    spp
        Samples per pixel; those of the scene's sampler where None.
    seed
        Of the samples.
    progress
        Called with the fraction that is done, in (0, 1], after each pass.

    Returns
    -------
    array of shape (height, width, 3)
        Linear Rec. 709 RGB, float32.

    Raises
    ------
    FormatError
        If the file cannot be read, is no scene, or has no sensor.
    NacreError
        If it needs more memory than there is, or its film does not give colors.
    MissingExtraError, LLVMError
        See :func:`nacre.render.mitsuba`.
    """
    scene = load_scene(path)
    sensors = scene.sensors()
    if not sensors:
        raise FormatError(f"{path}: has no sensor: add one to say what the picture shows")
    count = spp or int(sensors[0].sampler().sample_count())
    try:
        return render_scene(scene, count, seed, progress)
    except NacreError:
        raise
    except RuntimeError as error:
        raise NacreError(f"{path}: {_one_line(error)}") from error


def load_scene(path: PathLike) -> Any:
    """A scene file as Mitsuba's scene.

    Raises
    ------
    FormatError
        If the file cannot be read or is no scene that Mitsuba can make.
    """
    found = _load(path)
    if not isinstance(found, mitsuba().Scene):
        raise FormatError(f"{path}: is no <scene>, but a {type(found).__name__}")
    return found


def load_scene_with(path: PathLike, name: str, bsdf: str, properties: Mapping[str, Any]) -> Any:
    """A scene file as Mitsuba's scene, with another BSDF in place of one of its own.

    Parameters
    ----------
    path
        Mitsuba scene (`.xml`); files that it names are found beside it.
    name
        Id of the BSDF to replace; the other one has it, too.
    bsdf
        Name of the plugin that takes its place.
    properties
        Of that.

    Raises
    ------
    FormatError
        If the file cannot be read, is no scene that Mitsuba can make, or has no such BSDF.
    """
    mi = mitsuba()

    def made() -> Any:
        beside = mi.FileResolver(mi.file_resolver())
        beside.append(str(Path(path).parent))
        found = mi.file_resolver()
        mi.set_file_resolver(beside)
        try:
            return replaced()
        finally:
            mi.set_file_resolver(found)

    def replaced() -> Any:
        settings = mi.parser.ParserConfig(mi.variant())
        state = mi.parser.parse_file(settings, str(path))
        bsdfs = [node for node in state.nodes if node.type == mi.ObjectType.BSDF]
        names = [node.props.id() for node in bsdfs]
        if name not in names:
            known = ", ".join(n for n in names if not n.startswith("_arg_")) or "none"
            raise FormatError(f"{path}: has no BSDF {name!r} (found: {known})")
        other = mi.Properties(bsdf)
        for key, value in properties.items():
            other[key] = value
        other.set_id(name)
        bsdfs[names.index(name)].props = other
        mi.parser.transform_all(settings, state)
        return mi.parser.instantiate(settings, state)

    found = _made(path, made)
    if not isinstance(found, mi.Scene):
        raise FormatError(f"{path}: is no <scene>, but a {type(found).__name__}")
    return found


def scene_bsdfs(path: PathLike) -> list[Any]:
    """The BSDFs of a file: those of shapes, those that no shape has, or its only one.

    Raises
    ------
    FormatError
        If the file cannot be read, or Mitsuba can make nothing of it.
    """
    found, mi = _load(path), mitsuba()
    if isinstance(found, mi.BSDF):
        return [found]
    if not isinstance(found, mi.Scene):
        return []
    bsdfs = [shape.bsdf() for shape in found.shapes() if shape.bsdf()]
    # A callback class made here would end the process once it is garbage.
    found_at = mi.traverse(found).hierarchy.items()
    bsdfs += [child for child, (_, depth) in found_at if depth == 1 and isinstance(child, mi.BSDF)]
    return list(dict.fromkeys(bsdfs))


def _load(path: PathLike) -> Any:
    """What Mitsuba makes of a file."""
    return _made(path, lambda: mitsuba().load_file(str(path)))


def _made(path: PathLike, make: Callable[[], Any]) -> Any:
    """What is made of a file, with the plugins of this package."""
    check_scene(path)
    mitsuba()
    register()
    try:
        return make()
    except NacreError:
        raise
    except Exception as error:  # Mitsuba raises what its parser, plugins and bindings meet
        if is_shortage(error):
            raise NacreError(f"{path}: not enough memory to load the scene") from error
        raise FormatError(f"{path}: Mitsuba: {_one_line(error)}") from error


def _one_line(error: Exception) -> str:
    """What Mitsuba says, without the traceback of an error within a plugin of this package."""
    where, traceback, inner = str(error).partition("Traceback (most recent call last):")
    if traceback:
        last = inner.strip().splitlines()[-1]
        return f"{' '.join(where.split())} {last.partition(': ')[2]}"
    return " ".join(where.split())
