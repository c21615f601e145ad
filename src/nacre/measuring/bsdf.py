"""Mitsuba BSDFs from JSON descriptions or scene files."""

from __future__ import annotations

import json
from typing import Any

from nacre.errors import NacreError, reason
from nacre.io.files import PathLike
from nacre.measuring.virtual import MitsubaBrdf
from nacre.mitsuba.scene_file import scene_bsdfs


def description(text: str, where: str = "the description") -> dict[str, Any]:
    """A BSDF described by JSON, for `mitsuba.load_dict`.

    Raises NacreError, naming the description by `where`, if the text is not an object with a
    "type", or would end the process.
    """

    def refuse(name: str) -> None:
        raise NacreError(f"{where}: {name} is not a number of JSON")

    try:
        found = json.loads(text, parse_constant=refuse)
        problem = _fatal(found)
    except json.JSONDecodeError as error:
        raise NacreError(
            f"{where}: is no JSON: {error.msg} at character {error.pos + 1}"
        ) from error
    except RecursionError as error:
        raise NacreError(f"{where}: is nested too deeply") from error
    except ValueError as error:  # a number with too many digits
        raise NacreError(f"{where}: cannot be read: {reason(error)}") from error
    if not isinstance(found, dict) or not isinstance(found.get("type"), str):
        raise NacreError(f'{where}: expected an object with a type, like {{"type": "plastic"}}')
    if problem:
        raise NacreError(f"{where}: {problem}")
    return found


def described_bsdf(text: str, where: str = "the description") -> MitsubaBrdf:
    """The reflectance of a BSDF described by JSON, as for `mitsuba.load_dict`.

    Errors name the description by `where`.

    Raises
    ------
    NacreError
        If the text is not an object with a "type", or Mitsuba refuses it.
    """
    from nacre.mitsuba import register
    from nacre.mitsuba.engine import mitsuba

    given = description(text, where)
    register()
    try:
        bsdf = mitsuba().load_dict(given)
    except NacreError:
        raise
    except Exception as error:  # Mitsuba raises what its parser, plugins and pybind meet
        raise NacreError(f"{where}: Mitsuba: {reason(error, whole=True)}") from error
    return _virtual(bsdf, where)


def _fatal(value: Any, place: str = "") -> str | None:
    """The first thing in parsed JSON that would crash Mitsuba 3.9.1, in words."""
    if value is None:
        return f"{place[1:80]} is null; give it a value, or leave it out"
    if isinstance(value, dict) and value.get("type") == "blendbsdf" and "weight" not in value:
        return f"{place[1:80] or 'this'} has no weight; add one"
    parts = value.items() if isinstance(value, dict) else ()
    items = enumerate(value) if isinstance(value, list) else parts
    return next(filter(None, (_fatal(item, f"{place}.{key}") for key, item in items)), None)


def scene_bsdf(path: PathLike, name: str | None = None) -> MitsubaBrdf:
    """The reflectance of a BSDF in a Mitsuba scene (`.xml`); a single BSDF needs no id.

    Raises
    ------
    NacreError
        If the scene cannot be loaded, or has no such BSDF.
    """
    bsdfs = scene_bsdfs(path)
    found = {bsdf.id(): bsdf for bsdf in bsdfs if bsdf.id()}
    if name is None and len(bsdfs) == 1:
        return _virtual(bsdfs[0], f"{path}: {bsdfs[0].id() or 'its BSDF'}")
    if name not in found:
        problem = f"has no BSDF {name!r}" if name else "has more or less than one BSDF; use --bsdf"
        nameless = sum(not bsdf.id() for bsdf in bsdfs)
        names = [*found, f"{nameless} without an id"] if nameless else found
        raise NacreError(f"{path}: {problem} (found: {', '.join(names) or 'none'})")
    return _virtual(found[name], f"{path}: {name}")


def _virtual(bsdf: Any, where: str) -> MitsubaBrdf:
    """A Mitsuba BSDF as a reflectance."""
    from nacre.mitsuba.engine import mitsuba

    mi = mitsuba()
    if not isinstance(bsdf, mi.BSDF):
        raise NacreError(f"{where}: is not a BSDF")
    if not bsdf.flags() & int(mi.BSDFFlags.Smooth):
        raise NacreError(f"{where}: reflects only in single directions, so nothing can be measured")
    try:
        return MitsubaBrdf(bsdf)
    except NacreError as error:
        raise NacreError(f"{where}: {error}") from error
