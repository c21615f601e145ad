"""Recipes of surfaces: a generator, a seed and parameters, as plain data."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from nacre.errors import FormatError, did_you_mean, reason
from nacre.io.files import PathLike, read_bytes
from nacre.textures.capture.generators import GENERATORS, Generator
from nacre.textures.capture.mesostructure import Mesostructure

_LIMIT = 1 << 16
_KEYS = ("family", "seed", "parameters")
_UNSEEN = "12"


@dataclass(frozen=True)
class Recipe:
    """What a surface is made from: the material's name, a generator with its parameters, and the
    seed of all that is random in it.
    """

    name: str
    generator: Generator
    seed: int = 0

    @property
    def unseen(self) -> bool:
        """Whether it is the one recipe of its generator that is kept from training (Rainer et al.
        2020).
        """
        return self.name.endswith(_UNSEEN) and _built_in().get(self.name) == self

    def build(self, size: int = 256) -> Mesostructure:
        return self.generator.build(np.random.default_rng(self.seed), size)


def built_in() -> tuple[Recipe, ...]:
    """Twelve recipes for each of the seven generators, the last of which is kept from training."""
    return tuple(_built_in().values())


def find(source: PathLike) -> Recipe:
    """The built-in recipe with a name, or else the one in a JSON file.

    A file holds an object with `family`, and `seed` (0) and `parameters` (none) unless they are
    left at their defaults. A FormatError says that there is no such recipe, or names the bad field.
    """
    known = _built_in()
    if str(source) in known:
        return known[str(source)]
    path = Path(source)
    if not path.suffix and not path.exists():
        problem = "is neither a built-in recipe (fabric01 to wood12) nor a file"
        raise FormatError(f"{source}: {problem}{did_you_mean(str(source), known)}")
    data = read_bytes(path, _LIMIT)
    try:
        content = json.loads(data)
    except (ValueError, RecursionError) as error:
        raise FormatError(f"{path}: is not JSON: {reason(error)}") from error
    try:
        return _parse(path.stem, content)
    except ValueError as error:
        raise FormatError(f"{path}: {error}") from error


@cache
def _built_in() -> dict[str, Recipe]:
    found: dict[str, Recipe] = {}
    folder = resources.files("nacre.textures.capture") / "recipes"
    for generator in GENERATORS:
        content = json.loads((folder / f"{generator}.json").read_text("utf-8"))
        found |= {name: _parse(name, recipe) for name, recipe in content.items()}
    return found


def _parse(name: str, content: Any) -> Recipe:
    """A recipe from JSON; a :class:`ValueError` names the bad field."""
    if not isinstance(content, Mapping):
        raise ValueError("expected an object with family, seed and parameters")
    for key in content:
        if key not in _KEYS:
            raise ValueError(f"{key[:40]}: is not a field of a recipe ({', '.join(_KEYS)})")
    family, seed = content.get("family"), content.get("seed", 0)
    if not isinstance(family, str) or family not in GENERATORS:
        known = ", ".join(GENERATORS)
        raise ValueError(f"family: expected one of {known}, got {str(family)[:40]!r}")
    if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed < 1 << 64:
        raise ValueError(f"seed: expected a whole number from 0, got {str(seed)[:40]}")
    parameters = content.get("parameters", {})
    if not isinstance(parameters, Mapping):
        raise ValueError("parameters: expected an object")
    try:
        return Recipe(name, GENERATORS[family].from_json(parameters), seed)
    except ValueError as error:
        raise ValueError(f"parameters: {error}") from error
