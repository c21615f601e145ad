"""Exports as files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.errors import NacreError
from nacre.io.files import PathLike, check_writable, write_together
from nacre.runtime.progress import Progress
from nacre.targets.target import TARGETS, Target
from nacre.targets.text import identifier
from nacre.targets.textures import HeightField
from nacre.targets.textures.target import TextureTarget


def export(
    material: Brdf | Btf,
    target: str,
    output: PathLike = "",
    *,
    name: str = "",
    heights: HeightField | None = None,
    bytes_per_texel: int | None = None,
    progress: Progress | None = None,
) -> list[Path]:
    """Write a material as code or data for another tool; returns the files.

    Parameters
    ----------
    target
        One of :data:`nacre.targets.TARGETS`.
    output
        File to write, or a folder: if it ends with a slash, is a folder, or there are several
        files. By default files go to the working folder.
    name
        Names in the output begin with this, converted by :func:`identifier`; by default with the
        material's name.
    heights
        For parallax on an encoded texture.
    bytes_per_texel
        Of an encoded texture, one of :data:`nacre.targets.textures.filtered.SIZES`: its textures
        are then bytes that graphics cards filter.
    progress
        Called while a model is fitted, for targets that hold only that model.

    Raises
    ------
    NacreError
        If there is no such target, it cannot hold the material, or a file cannot be written.
    """
    found = contents(
        material,
        target,
        name=name,
        heights=heights,
        bytes_per_texel=bytes_per_texel,
        progress=progress,
    )
    return write_files(found, output)


def contents(
    material: Brdf | Btf,
    target: str,
    *,
    name: str = "",
    heights: HeightField | None = None,
    bytes_per_texel: int | None = None,
    progress: Progress | None = None,
) -> Mapping[str, bytes]:
    """What :func:`export` writes, by the names of the files.

    Raises NacreError if there is no such target, or it cannot hold the material.
    """
    named = identifier(name or material.name)
    try:
        chosen = _target(target, heights, bytes_per_texel)
        if isinstance(material, Brdf):
            material = chosen.held(chosen.reflectance(material), progress)
        return chosen.files(material, named)
    except NacreError as error:
        raise NacreError(f"{target}: {error}") from error


def _target(name: str, heights: HeightField | None, bytes_per_texel: int | None) -> Target:
    kind = TARGETS.find(name)
    given = {"height field": heights, "bytes per texel": bytes_per_texel}
    asked = [what for what, value in given.items() if value is not None]
    if not asked:
        return kind()
    if not issubclass(kind, TextureTarget):
        raise NacreError(f"takes no {asked[0]}, and no textures")
    return kind(heights, bytes_per_texel)


def write_files(contents: Mapping[str, bytes], output: PathLike) -> list[Path]:
    """Write files with these names and contents; see :func:`export`."""
    folder = Path(output)
    into = str(output).endswith("/") or folder.is_dir() or len(contents) > 1
    paths = [folder / name for name in contents] if into else [folder]
    for path in paths:
        if into:
            path.parent.mkdir(parents=True, exist_ok=True)
        check_writable(path)
    write_together(dict(zip(paths, contents.values(), strict=True)))
    return paths
