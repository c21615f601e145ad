"""A nacre file (.json), checked before anything from it reaches Blender."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

Rows = list[list[float]]
"""A table of up to three rows: a color has a row per channel, a number one row of one."""

FACING = tuple(k / 15 for k in (0, 1, 2, 3, 5, 7, 9, 12, 15))
"""Cosines between normal and view at the nodes of closures' tables."""

LOBES = 3
"""GGX closures of a mixture."""

BENDS = -0.9, 5.0
"""Range of the bends of normals."""

_MAX_BYTES = 1 << 20
_MAX_TEXT = 200
_SETTINGS = frozenset({"gain", "samples", "starts", "seed"})
"""Settings of fits, which tell nothing about the result."""
_Table = tuple[int, float, float]  # rows of a table, and the range of its numbers


class MaterialError(Exception):
    """A file cannot be imported; the message is one line."""


@dataclass(frozen=True)
class NacreMaterial:
    """The contents of a file: tables by parameter name, and facts for people by label."""

    name: str
    model: str
    values: dict[str, Rows]
    facts: dict[str, str] = field(default_factory=dict)


def read_file(path: Path) -> NacreMaterial:
    """Read a material; MaterialError if the file is not one, too long, or cannot be read."""
    try:
        with path.open("rb") as file:
            text = file.read(_MAX_BYTES + 1)
    except OSError as error:
        raise MaterialError(f"{path.name}: {error.strerror or error}") from error
    return read(text, path.name)


def read(text: str | bytes, place: str) -> NacreMaterial:
    """Read a material from the text of a file; errors start with `place`."""
    try:
        return _material(_parsed(text), place)
    except MaterialError as error:
        raise MaterialError(f"{one_line(place)}: {error}") from error


def one_line(text: object) -> str:
    """Text from a file as people see it: on one line, with bounded length."""
    return " ".join("".join(c if c.isprintable() else " " for c in str(text)).split())[:_MAX_TEXT]


def _parsed(text: str | bytes) -> dict[str, Any]:
    if len(text) > _MAX_BYTES:
        raise MaterialError("is longer than 1 MB")
    try:
        content = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise MaterialError(f"is not whole JSON: {one_line(error)}") from error
    if not isinstance(content, dict) or not isinstance(content.get("model"), str):
        raise MaterialError("is not a nacre material: it names no model")
    return content


def _material(content: dict[str, Any], place: str) -> NacreMaterial:
    model, given = content["model"], content.get("parameters")
    if model not in MODELS:
        raise MaterialError(
            f"model {one_line(model)[:40]!r} is not one of {', '.join(MODELS)}; "
            "nacre export --to blender-addon writes any material as closures"
        )
    if content.get("version", 1) != 1:
        raise MaterialError("was written by another version of nacre; update the add-on")
    if not isinstance(given, dict):
        raise MaterialError("has no parameters")
    values = {one_line(name): _rows(one_line(name), value) for name, value in given.items()}
    _check(values, *MODELS[model])
    name = content.get("name")
    name = one_line(name) if isinstance(name, str) else ""
    return NacreMaterial(name or one_line(Path(place).stem), model, values, _facts(content))


def _rows(name: str, value: Any) -> Rows:
    """A number, a color or a table as rows."""
    if not isinstance(value, list):
        value = [value]
    rows = [row if isinstance(row, list) else [row] for row in value]
    if not 1 <= len(rows) <= 3 or any(len(row) != len(rows[0]) for row in rows):
        raise MaterialError(f"{name} is not a number, color or table")
    return [[_number(name, number) for number in row] for row in rows]


def _number(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e6:
        raise MaterialError(
            f"{name} holds {one_line(json.dumps(value))[:40]}, not a number below 1e6"
        )
    return float(value)


def _check(values: dict[str, Rows], known: dict[str, _Table], nodes: int) -> None:
    """MaterialError unless the tables are those of the model, with all nodes, and in range."""
    if values.keys() != known.keys():
        names = sorted(values.keys() ^ known.keys())
        raise MaterialError(f"missing or unknown parameters: {', '.join(names)[:80]}")
    for name, rows in values.items():
        height, low, high = known[name]
        if len(rows) != height or len(rows[0]) != nodes:
            raise MaterialError(f"{name} takes {height} rows of {nodes} numbers")
        if not all(low <= number <= high for row in rows for number in row):
            raise MaterialError(f"{name} is not in [{low:g}, {high:g}] throughout")


def _closures() -> dict[str, _Table]:
    bend = (1, *BENDS)
    tables = {"diffuse": (3, 0.0, 10.0), "bend0": bend}
    for k in range(1, LOBES + 1):
        tables |= {f"color{k}": (3, 0.0, 10.0), f"bend{k}": bend}
        tables |= {f"roughness{k}": (2, 0.0, 1.0)}
    return tables


_NUMBER, _COLOR, _INDEX = (1, 0.0, 1.0), (3, 0.0, 1.0), (1, 1.0, 4.0)
_PRINCIPLED: dict[str, _Table] = {
    **dict.fromkeys(("base_color", "specular_tint", "coat_tint", "sheen_tint"), _COLOR),
    **dict.fromkeys(("ior", "coat_ior"), _INDEX),
    **dict.fromkeys(("metallic", "roughness", "specular_ior_level", "diffuse_roughness"), _NUMBER),
    **dict.fromkeys(("coat_weight", "coat_roughness"), _NUMBER),
    **dict.fromkeys(("sheen_weight", "sheen_roughness"), _NUMBER),
}
_AXES = {"anisotropic": _NUMBER, "anisotropic_rotation": _NUMBER}
_FILM: dict[str, _Table] = {"thin_film_thickness": (1, 1.0, 2000.0), "thin_film_ior": _INDEX}

MODELS = {
    "closures": (_closures(), len(FACING)),
    "principled": (_PRINCIPLED, 1),
    "principled-anisotropic": (_PRINCIPLED | _AXES, 1),
    "principled-film": (_PRINCIPLED | _FILM, 1),
    "principled-film-anisotropic": (_PRINCIPLED | _AXES | _FILM, 1),
}
"""Tables of the models that can be read, and how many nodes they have."""


def _facts(content: dict[str, Any]) -> dict[str, str]:
    """What the file tells about errors, source and terms."""
    metadata = content.get("metadata")
    parts = metadata if isinstance(metadata, dict) else {}
    facts = {"Model": one_line(content["model"])}
    for part in ("errors", "fit", "source"):
        known = parts.get(part)
        for key, value in known.items() if isinstance(known, dict) else ():
            shown = isinstance(value, str | int | float) and not isinstance(value, bool)
            if not shown or key in _SETTINGS:
                continue
            text = f"{value:.5g}" if isinstance(value, float) else one_line(value)
            label = f"{part} {one_line(key)}".replace("_", " ").capitalize()
            facts[label[:60]] = text
    facts.setdefault("Source terms", "not recorded")
    return dict(list(facts.items())[:24])
