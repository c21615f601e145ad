"""`nacre.export`: a material as code or data for other tools."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.errors import NacreError
from nacre.io.files import PathLike
from nacre.runtime.progress import Progress
from nacre.targets import TARGETS
from nacre.targets.files import contents, write_files
from nacre.targets.textures import HeightField
from nacre.verbs.material import Given, closest, opened, path_of

if TYPE_CHECKING:
    from nacre.workflows.places import Candidate


@dataclass(frozen=True, repr=False, eq=False)
class Exported(Mapping[str, str | bytes]):
    """Files by name: text, or bytes where a file is none. `str()` of it is its only text."""

    target: str
    files: Mapping[str, bytes]
    paths: tuple[Path, ...] = ()  # where they were written
    representations: tuple[Candidate, ...] = ()
    """For a place: what it can hold, with the errors of each; the first was chosen."""

    def __getitem__(self, name: str) -> str | bytes:
        content = self.files[name]
        try:
            return content if b"\0" in content else content.decode()
        except UnicodeDecodeError:
            return content

    def __iter__(self) -> Iterator[str]:
        return iter(self.files)

    def __len__(self) -> int:
        return len(self.files)

    @property
    def text(self) -> str:
        """The text of the only file; NacreError if there are several, or it is no text."""
        found = list(self.values())
        if len(found) == 1 and isinstance(found[0], str):
            return found[0]
        names = ", ".join(self)
        raise NacreError(f"{self.target}: is not one text but {names}; write .save(folder)")

    def save(self, output: PathLike = "") -> tuple[Path, ...]:
        """Write the files; returns their paths.

        `output` is a file, or a folder if it ends with a slash, is a folder, or there are several
        files; the working folder by default. Raises NacreError if a file cannot be written.
        """
        return tuple(write_files(self.files, output))

    def __str__(self) -> str:
        try:
            return self.text
        except NacreError:
            return repr(self)

    def __repr__(self) -> str:
        names = self.paths or self.files
        sizes = map(len, self.files.values())
        listed = ", ".join(f"{name} ({n:,} bytes)" for name, n in zip(names, sizes, strict=True))
        done = "written" if self.paths else ".save(folder) writes what it holds"
        return f"<{self.target}: {listed}; {done}>"


def export(
    material: Given,
    to: str,
    output: PathLike | None = None,
    *,
    name: str = "",
    basis: PathLike = "neural",
    height_field: PathLike | None = None,
    depth: float | None = None,
    bytes_per_texel: int | None = None,
    license: str = "",  # noqa: A002 - the command's option
    progress: Progress | None = None,
) -> Exported:
    """A material as shader code or for another tool.

    Parameters
    ----------
    material
        A material, its path or name, or the path of a latent code (`.json`).
    to
        A target, one of :data:`nacre.targets.TARGETS` ("glsl", "wgsl", "c", "onnx", ...); or a
        place, one of :data:`nacre.workflows.places.PLACES` ("blender", "unreal", "web", ...), for
        which nacre chooses what shows the material best.
    output
        File or folder to write at once; see :meth:`Exported.save`.
    name
        Prefix of the names in the output; the material's by default.
    basis
        Latent basis of a code; see :func:`nacre.latent.find_basis`.
    height_field, depth
        Gray image for parallax on an encoded texture, and its depth in widths of the texture.
    bytes_per_texel
        Of an encoded texture, 4, 8, 12 and so on to 32: it becomes RGBA8 textures with mipmaps.
    license
        Terms of use to put at the beginning of the output; those of the source by default.
    progress
        Called while a model is fitted, for targets that hold only that model.

    Returns
    -------
    Exported
        The files by name. `print(nacre.export(m, "glsl"))` prints the code.

    Raises
    ------
    NacreError
        If there is no such target or place, it cannot hold the material, or a file cannot be
        written.

    Examples
    --------
    >>> import nacre
    >>> files = nacre.export("rgl:paper_white", "glsl", name="paper")
    >>> list(files), "vec3 paper_eval(" in files.text
    (['paper.glsl'], True)
    """
    from nacre.workflows.places import PLACES

    if to not in TARGETS and to not in PLACES:
        known = [*TARGETS, *PLACES]
        raise NacreError(f"{to!r} is no export target or place{closest(to, known)}")
    found = _opened(material, basis)
    if license:
        found = found.replaced(source={**(found.source or {}), "terms": license})
    if not name and (path := path_of(material)) is not None:
        name = path.stem  # as the command does
    if to in PLACES:
        if bytes_per_texel is not None:
            raise NacreError(f"bytes per texel: {to} takes no textures")
        made = _to_place(found, to, name, height_field, progress)
    else:
        heights = _heights(height_field, depth)
        files = contents(
            found,
            to,
            name=name,
            heights=heights,
            bytes_per_texel=bytes_per_texel,
            progress=progress,
        )
        made = Exported(to, files)
    return made if output is None else replace(made, paths=made.save(output))


def _opened(material: Given, basis: PathLike) -> Brdf | Btf:
    from nacre.latent.file import find_basis, is_code, load_code

    path = path_of(material)
    if path is not None and is_code(path):
        return load_code(path, find_basis(basis))
    return opened(material)


def _heights(image: PathLike | None, depth: float | None) -> HeightField | None:
    if image is None:
        if depth is not None:
            raise NacreError("depth is that of a height field; add height_field=...")
        return None
    return HeightField.read(Path(image), depth)


def _to_place(
    material: Brdf | Btf,
    place: str,
    name: str,
    height_field: PathLike | None,
    progress: Progress | None,
) -> Exported:
    from nacre.workflows.places import place_contents

    if isinstance(material, Btf) or height_field is not None:
        raise NacreError(f"{material.name}: is a texture, but {place} takes reflectances only")
    found, files = place_contents(material, place, name=name, progress=progress)
    return Exported(place, files, representations=tuple(found))
