"""Scene files in Mitsuba's XML, read with this package's plugins, as they are or with changes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from nacre.errors import FormatError, NacreError, did_you_mean, is_shortage, reason
from nacre.io.files import PathLike
from nacre.mitsuba.engine import mitsuba
from nacre.mitsuba.plugins import register
from nacre.mitsuba.scene_guard import check_scene

_FILM_SIZE = {"width": 768, "height": 576}
"""What Mitsuba's films have where a scene does not say."""


@dataclass(frozen=True)
class SceneChanges:
    """What to change in a scene file as it is loaded.

    Parameters
    ----------
    parameters
        Values for the scene's parameters, `$name`, in place of those of its `<default>`s.
    sensor
        Number, from 0, or id of the sensor that is rendered; the first where None.
    width, height
        Of the film of that sensor, in pixels; where one of them is None, the film keeps its
        proportions. A crop window stays where it is.
    box_filter
        Whether that film does not share samples between pixels.
    """

    parameters: Mapping[str, str] = field(default_factory=dict)
    sensor: int | str | None = None
    width: int | None = None
    height: int | None = None
    box_filter: bool = False


@dataclass(frozen=True)
class LoadedScene:
    """A scene file as Mitsuba's scene.

    Parameters
    ----------
    scene
        The scene.
    sensor
        Number of the sensor to render.
    aovs
        Names of the extra channels that the scene asks for, by their kinds: "albedo", "depth", ...
    """

    scene: Any
    sensor: int
    aovs: Mapping[str, str]


def load_scene(path: PathLike) -> Any:
    """A scene file as Mitsuba's scene; raises FormatError if Mitsuba cannot read one from it."""
    return _scene(path, lambda: mitsuba().load_file(str(path)))


def load_changed_scene(path: PathLike, changes: SceneChanges) -> LoadedScene:
    """A scene file with changes, and with a sensor.

    Raises FormatError if Mitsuba cannot read a scene from it, or it has no such parameter or
    sensor.
    """
    found: dict[str, Any] = {}

    def change(state: Any) -> None:
        if sensors := list(_sensors(state)):
            found["sensor"] = _sensor_number(path, sensors, changes.sensor)
            found["aovs"] = dict(_aovs(state))
            _change_film(state, sensors[found["sensor"]], changes)

    scene = _scene(path, lambda: _parsed(path, change, changes.parameters), changes.parameters)
    if not found:
        raise FormatError(f"{path}: has no sensor: add one to say what the picture shows")
    return LoadedScene(scene, **found)


def load_scene_with(path: PathLike, name: str, bsdf: str, properties: Mapping[str, Any]) -> Any:
    """A scene file as Mitsuba's scene, with another BSDF in place of the one with id `name`.

    `bsdf` is the plugin that takes its place, with some properties. Raises FormatError if Mitsuba
    cannot read a scene from the file, or it has no such BSDF.
    """
    mi = mitsuba()

    def replace(state: Any) -> None:
        bsdfs = [node for node in state.nodes if node.type == mi.ObjectType.BSDF]
        names = [node.props.id() for node in bsdfs]
        if name not in names:
            known = ", ".join(n for n in names if n and not n.startswith("_arg_")) or "none"
            raise FormatError(f"{path}: has no BSDF {name!r} (found: {known})")
        other = mi.Properties(bsdf)
        for key, value in properties.items():
            other[key] = value
        other.set_id(name)
        bsdfs[names.index(name)].props = other

    return _scene(path, lambda: _parsed(path, replace))


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


def _scene(
    path: PathLike, make: Callable[[], Any], parameters: Mapping[str, str] | None = None
) -> Any:
    found = _made(path, make, parameters)
    if not isinstance(found, mitsuba().Scene):
        raise FormatError(f"{path}: is not a <scene> but a {type(found).__name__}")
    return found


def _made(
    path: PathLike, make: Callable[[], Any], parameters: Mapping[str, str] | None = None
) -> Any:
    """Make something from a file, with this package's plugins and errors."""
    names = check_scene(path, parameters)
    for given in parameters or {}:
        if given not in names:
            known = ", ".join(sorted(names)) or "none"
            hint = did_you_mean(given, names)
            raise FormatError(f"{path}: has no parameter {given!r} (found: {known}){hint}")
    mitsuba()
    register()
    try:
        return make()
    except NacreError:
        raise
    except Exception as error:  # Mitsuba raises what its parser, plugins and bindings meet
        if is_shortage(error):
            raise NacreError(f"{path}: not enough memory to load the scene") from error
        raise FormatError(f"{path}: Mitsuba: {scene_reason(error)}") from error


def scene_reason(error: BaseException) -> str:
    """What Mitsuba says is wrong with a scene, on one line, with what to do about a variant."""
    while (cause := error.__cause__ or error.__context__) is not None:
        error = cause  # Dr.Jit hides what went wrong behind the place where it did
    text = reason(RuntimeError(str(error).partition("\n\n")[0]), whole=True)
    needs = "spectral simulation" in text, "polarized mode" in text
    variant = {(True, False): "llvm_ad_spectral", (False, True): "llvm_ad_spectral_polarized"}
    if needs in variant:
        return f"{text.rstrip('.!')}; the variant {variant[needs]} does"
    return text


def _parsed(
    path: PathLike, change: Callable[[Any], None], parameters: Mapping[str, str] | None = None
) -> Any:
    """What Mitsuba makes of a file after a change to what its parser found."""
    mi = mitsuba()
    beside = mi.FileResolver(mi.file_resolver())
    beside.append(str(Path(path).parent))
    found = mi.file_resolver()
    mi.set_file_resolver(beside)
    try:
        settings = mi.parser.ParserConfig(mi.variant())
        state = mi.parser.parse_file(settings, str(path), **(parameters or {}))
        mi.parser.transform_all(settings, state)
        if state.root.type == mi.ObjectType.Scene:
            change(state)
        return mi.parser.instantiate(settings, state)
    finally:
        mi.set_file_resolver(found)


def _children(state: Any, node: Any) -> Iterator[tuple[str, Any]]:
    """The nodes within a node, with the names under which it has them."""
    for name, value in node.props.items():
        if isinstance(value, mitsuba().Properties.ResolvedReference):
            yield name, state.nodes[value.index()]


def _sensors(state: Any, of: Any = None) -> Iterator[Any]:
    """The sensors of a scene, those of shapes too, in Mitsuba's order."""
    kinds = mitsuba().ObjectType
    for _, node in _children(state, of or state.root):
        if node.type == kinds.Sensor:
            yield node
        elif node.type == kinds.Shape and node.props.plugin_name() != "shapegroup":
            yield from _sensors(state, node)


def _sensor_number(path: PathLike, sensors: list[Any], wanted: int | str | None) -> int:
    ids = [node.props.id() for node in sensors]
    if wanted is None:
        return 0
    if wanted in ids:
        return ids.index(str(wanted))
    if str(wanted).isdecimal() and int(wanted) < len(sensors):
        return int(wanted)
    names = [node.props.id() or node.props.plugin_name() for node in sensors]
    known = ", ".join(f"{number} {name}" for number, name in enumerate(names))
    raise FormatError(f"{path}: has no sensor {wanted!r} (found: {known})")


def _aovs(state: Any) -> Iterator[tuple[str, str]]:
    """Kinds and names of the channels that an `aov` integrator is asked for."""
    for node in state.nodes:
        if node.type == mitsuba().ObjectType.Integrator and node.props.plugin_name() == "aov":
            for pair in str(node.props.get("aovs", "")).split(","):
                name, _, kind = pair.strip().partition(":")
                yield kind, name


def _change_film(state: Any, sensor: Any, changes: SceneChanges) -> None:
    mi = mitsuba()
    given = {"width": changes.width, "height": changes.height}
    if given == dict.fromkeys(given) and not changes.box_filter:
        return
    films = [node for _, node in _children(state, sensor) if node.type == mi.ObjectType.Film]
    film = films[0].props if films else mi.Properties("hdrfilm")
    before = {name: int(film.get(name, size)) for name, size in _FILM_SIZE.items()}
    kept = next((size / before[name] for name, size in given.items() if size), 1.0)
    for name, size in given.items():
        film[name] = size or max(1, round(kept * before[name]))
    if changes.box_filter:
        for name, node in [pair for film in films for pair in _children(state, film)]:
            if node.type == mi.ObjectType.ReconstructionFilter:
                del film[name]
        film["rfilter"] = mi.load_dict({"type": "box"})
    if not films:
        sensor.props["film"] = mi.PluginManager.instance().create_object(film)
