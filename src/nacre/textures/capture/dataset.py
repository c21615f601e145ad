"""All built-in recipes captured into one folder, in as many runs as it takes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from nacre.array import Floats
from nacre.errors import FormatError, reason
from nacre.io.files import abandoned, atomic_path, check_json, read_bytes
from nacre.measured.textures import archive
from nacre.runtime.lock import exclusive
from nacre.runtime.progress import Progress
from nacre.textures.capture.generators import GENERATORS
from nacre.textures.capture.generators.generator import current_names
from nacre.textures.capture.gonioreflectometer import Capture
from nacre.textures.capture.mesostructure import Mesostructure
from nacre.textures.capture.recipe import Recipe, built_in

MANIFEST = "capture.json"  # name of the file with the settings and recipes, in the folder

_MANIFEST_LIMIT = 1 << 20


@dataclass(frozen=True, eq=False)
class Settings:
    """How to capture: at pairs of unit directions, shape (n, 3), with so many rows and columns of
    texels and so many paths per texel and view; the same seed gives the same values.
    """

    wi: Floats
    wo: Floats
    texels: int = 32
    samples: int = 64
    seed: int = 0

    @property
    def cells(self) -> int:
        """Cells along each side of the surfaces."""
        return min(1024, max(256, 4 * self.texels))

    def build(self, recipe: Recipe) -> Mesostructure:
        return recipe.build(self.cells)

    def capture(self, recipe: Recipe, *, on_surface: bool = False) -> Capture:
        """The surface of a recipe, measured where and when values are asked for."""
        return Capture(
            self.build(recipe), self.wi, self.wo, self.texels, samples=self.samples,
            seed=self.seed, on_surface=on_surface, name=recipe.name,
        )  # fmt: skip

    def describe(self) -> dict[str, Any]:
        """As plain data; directions by number and SHA-256."""
        directions = hashlib.sha256(self.wi.tobytes() + self.wo.tobytes()).hexdigest()
        numbers = {name: getattr(self, name) for name in ("texels", "samples", "seed")}
        return numbers | {"pairs": len(self.wi), "directions": directions}


def place(recipe: Recipe) -> Path:
    """Where a recipe's texture lies in the folder: in `unseen` if it is kept from training."""
    return Path("unseen" if recipe.unseen else "train") / f"{recipe.name}.npz"


def capture_all(
    folder: Path, settings: Settings, report: Callable[[Recipe, int, int], Progress] | None = None
) -> None:
    """Capture every built-in recipe that the folder, created if need be, does not hold yet.

    A file is there only when it is whole, so a run that was killed loses one texture.
    `report(recipe, done, total)` is called before each and gives what is called with its progress.
    A :class:`FormatError` says that the folder was filled with other settings or recipes, or that
    another process is filling it.
    """
    with ExitStack() as stack:
        for part in (folder, folder / "train", folder / "unseen"):
            part.mkdir(parents=True, exist_ok=True)
        try:
            stack.enter_context(exclusive(folder / ".lock", wait=False))
        except BlockingIOError:
            raise FormatError(f"{folder}: another process is filling it; wait for it") from None
        for part in (folder, folder / "train", folder / "unseen"):
            for path in abandoned(part):
                path.unlink()
        recipes = built_in()
        _settle(folder / MANIFEST, settings, recipes)
        for done, recipe in enumerate(recipes):
            path = folder / place(recipe)
            if not path.exists():
                progress = report(recipe, done, len(recipes)) if report else None
                archive.save(settings.capture(recipe), path, progress=progress)


def _settle(path: Path, settings: Settings, recipes: tuple[Recipe, ...]) -> None:
    """Write the manifest, or compare with the one that is there."""
    textures = {
        place(r).as_posix(): {
            "family": r.generator.name, "seed": r.seed, "parameters": asdict(r.generator)
        }
        for r in recipes
    }  # fmt: skip
    new = json.loads(json.dumps(settings.describe() | {"textures": textures}))
    if not path.exists():
        with atomic_path(path, internal=True) as temporary:
            temporary.write_text(json.dumps(new, indent=1), "utf-8")
        return
    data = read_bytes(path, _MANIFEST_LIMIT)
    try:
        old = json.loads(data, object_pairs_hook=lambda pairs: current_names(dict(pairs)))
        check_json(old)
    except (ValueError, RecursionError) as error:
        raise FormatError(f"{path}: is not JSON: {reason(error)}; choose another folder") from error
    if not isinstance(old, dict):
        raise FormatError(f"{path}: is not a manifest; choose another folder")
    if isinstance(listed := old.get("textures"), dict):
        old["textures"] = {name: _completed(texture) for name, texture in listed.items()}
    for key, value in new.items():
        if old.get(key) != value:
            note = "" if isinstance(value, dict) else f" ({old.get(key)!r}, now {value!r})"
            raise FormatError(
                f"{path}: {key}: the folder was started with others{note}; choose another folder"
            )


def _completed(texture: Any) -> Any:
    """A texture in a manifest; parameters that its family did not have then get their defaults."""
    try:
        family = fields(GENERATORS[texture["family"]])
        defaults = json.loads(json.dumps({field.name: field.default for field in family}))
        return texture | {"parameters": defaults | texture["parameters"]}
    except (LookupError, TypeError):
        return texture
