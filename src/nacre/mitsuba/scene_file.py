"""Scene files in Mitsuba's XML: read with this package's plugins, and rendered."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from nacre.array import Image
from nacre.errors import FormatError, NacreError, is_shortage, reason
from nacre.io.files import PathLike
from nacre.mitsuba.engine import mitsuba
from nacre.mitsuba.plugins import register
from nacre.mitsuba.preview import render_scene
from nacre.mitsuba.scene_guard import check_scene


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
        Samples per pixel; by default those of the scene's sampler.
    seed
        For the samples.
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
        See :func:`nacre.mitsuba.mitsuba`.
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
        raise NacreError(f"{path}: {reason(error, whole=True)}") from error


def load_scene(path: PathLike) -> Any:
    """A scene file as Mitsuba's scene; raises FormatError if Mitsuba cannot read one from it."""
    return _scene(path, lambda: mitsuba().load_file(str(path)))


def load_scene_with(path: PathLike, name: str, bsdf: str, properties: Mapping[str, Any]) -> Any:
    """A scene file as Mitsuba's scene, with another BSDF in place of the one with id `name`.

    `bsdf` is the plugin that takes its place, with some properties. Raises FormatError if Mitsuba
    cannot read a scene from the file, or it has no such BSDF.
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

    return _scene(path, made)


def scene_bsdfs(path: PathLike) -> list[Any]:
    """The BSDFs in a file: those of shapes, those that no shape has, or its only one.

    Raises FormatError if Mitsuba cannot read the file.
    """
    mi = mitsuba()
    found = _made(path, lambda: mi.load_file(str(path)))
    if isinstance(found, mi.BSDF):
        return [found]
    if not isinstance(found, mi.Scene):
        return []
    bsdfs = [shape.bsdf() for shape in found.shapes() if shape.bsdf()]
    # A callback class defined here would crash the process when it is collected.
    found_at = mi.traverse(found).hierarchy.items()
    bsdfs += [child for child, (_, depth) in found_at if depth == 1 and isinstance(child, mi.BSDF)]
    return list(dict.fromkeys(bsdfs))


def _scene(path: PathLike, make: Callable[[], Any]) -> Any:
    found = _made(path, make)
    if not isinstance(found, mitsuba().Scene):
        raise FormatError(f"{path}: is not a <scene> but a {type(found).__name__}")
    return found


def _made(path: PathLike, make: Callable[[], Any]) -> Any:
    """Make something from a file, with this package's plugins and errors."""
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
        raise FormatError(f"{path}: Mitsuba: {reason(error, whole=True)}") from error
