"""A folder of materials as an asset library: a .blend with thumbnails, and its catalogs."""

import os
import uuid
from collections.abc import Iterator
from pathlib import Path

import bpy

from nacre.targets.blender_addon.asset import mark, studio, thumbnail
from nacre.targets.blender_addon.nodes import build
from nacre.targets.blender_addon.reading import MaterialError, read_file

LIBRARY = "nacre_materials.blend"
"""File name of a folder's library."""

CATALOGS = "blender_assets.cats.txt"
"""Blender's file name for the catalogs of a library."""


def write_library(folder: Path) -> Iterator[str]:
    """Write :data:`LIBRARY` with all nacre files in a folder, in an empty session of Blender.

    This replaces the contents of the session, and an existing library; catalogs are added to those
    in the folder. Yields a line for each file that is done or skipped. Raises MaterialError if
    there is no material, or the folder cannot be written.
    """
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene, ball = studio()
    made = []
    for path in sorted(folder.glob("*.json")):
        try:
            given = read_file(path)
        except MaterialError as error:
            yield f"skipped {error}"
            continue
        material = build(given)
        mark(material, given)
        material.asset_data.catalog_id = str(_catalog(given.model))
        thumbnail(scene, ball, material)
        made.append(material)
        yield f"added {path.name}"
    if not made:
        raise MaterialError(f"{folder.name}: no file here is a nacre material")
    part = folder / f".{LIBRARY}.{os.getpid()}.blend"
    try:
        _add_catalogs(folder / CATALOGS, {material["nacre"]["Model"] for material in made})
        bpy.data.libraries.write(str(part), set(made), fake_user=True, compress=True)
        part.replace(folder / LIBRARY)
    except (OSError, RuntimeError) as error:
        part.unlink(missing_ok=True)
        raise MaterialError(f"{folder.name}: cannot be written: {error}") from error


def _catalog(model: str) -> uuid.UUID:
    """The same id for a model everywhere, so that libraries in different folders share it."""
    return uuid.uuid5(uuid.NAMESPACE_URL, f"nacre/{model}")


def _add_catalogs(path: Path, models: set[str]) -> None:
    """Add catalogs for models after the existing ones."""
    text = path.read_text("utf-8") if path.exists() else "VERSION 1\n\n"
    lines = [f"{_catalog(model)}:nacre/{model}:nacre-{model}" for model in sorted(models)]
    missing = [line for line in lines if line.partition(":")[0] not in text]
    if not missing:
        return
    end = "" if text.endswith("\n") else "\n"
    part = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        part.write_text(text + end + "".join(f"{line}\n" for line in missing), "utf-8")
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)
