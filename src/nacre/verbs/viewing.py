"""`nacre.view`: a page that shows materials in a browser."""

from __future__ import annotations

import html
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.errors import FormatError, NacreError
from nacre.io.files import PathLike, atomic_path
from nacre.mitsuba.environment import Environment
from nacre.runtime.progress import Progress, silent
from nacre.targets.textures import HeightField
from nacre.verbs.material import Given, opened, path_of
from nacre.verbs.rendering import lighting
from nacre.workflows.viewing import find_materials, in_memory, page_content, read_materials

if TYPE_CHECKING:
    from nacre.viewer.content import Entry
    from nacre.workflows.viewing import Texture

_PIXELS = 640  # height in a notebook


@dataclass(frozen=True, repr=False, eq=False)
class Page:
    """A web page in one file, which needs only a browser."""

    title: str
    materials: int  # how many it shows
    content: bytes  # UTF-8

    def save(self, path: PathLike) -> Path:
        """Write it (`.html`); returns the path. Raises FormatError if it cannot be written."""
        path = Path(path)
        if path.suffix.lower() not in (".html", ".htm"):
            raise FormatError(f"{path}: expected a name that ends in .html")
        with atomic_path(path) as temporary:
            temporary.write_bytes(self.content)
        return path

    def __repr__(self) -> str:
        several = "" if self.materials == 1 else "s"
        about = f"{self.materials} material{several}, {len(self.content):,} bytes"
        return f"<Page {self.title!r}: {about}; .save('page.html') writes it>"

    def _repr_html_(self) -> str:
        page = html.escape(self.content.decode())
        return (
            f'<iframe srcdoc="{page}" title="{html.escape(self.title)}" sandbox="allow-scripts" '
            f'style="width:100%;height:{_PIXELS}px;border:0"></iframe>'
        )


def view(
    *materials: Given,
    title: str | None = None,
    environment: Environment | PathLike | Sequence[Environment | PathLike] = (),
    map: bool = False,  # noqa: A002 - the command's option
    height_field: PathLike | None = None,
    depth: float | None = None,
    notice: str | None = None,
    progress: Progress | None = None,
) -> Page:
    """Show materials on a web page, where you can turn them in the light and compare them.

    Parameters
    ----------
    materials
        Materials, paths, folders or names. Reflectances of one name, and files of one name in one
        folder, are forms of one material: measured, network, standard. Textures must be encoded.
    title
        Heading of the page; the material's name, or "Materials".
    environment
        Latitude-longitude maps to offer as light; the built-in ones by default.
    map
        Add a map for exploring what lies between the materials; 0.6 MB.
    height_field, depth
        Gray image for parallax of a single texture, and its depth in widths of the texture.
    notice
        Text for the foot of the page, such as a license.
    progress
        Called as materials are read.

    Returns
    -------
    Page
        Notebooks show it, in a frame; `.save("page.html")` writes it.

    Raises
    ------
    NacreError
        If a material cannot be read, or a page cannot show it; the message says why.
    """
    if not materials:
        raise TypeError("view() takes at least one material: nacre.view(material)")
    maps = (
        [environment]
        if isinstance(environment, Environment | str | os.PathLike)
        else [*environment]
    )
    if depth is not None and height_field is None:
        raise NacreError("depth is that of a height field; add height_field=...")
    content, count = page_content(
        _shown(materials),
        environments=[light for light in [lighting(each) for each in maps] if light is not None],
        mapped=map,
        heights=None if height_field is None else HeightField.read(Path(height_field), depth),
        notice=notice,
        total=len(materials),
        progress=progress or silent,
    )
    heading = title or _title(materials)
    return Page(heading, count, content.page(heading))


def _shown(materials: Sequence[Given]) -> Iterator[Entry | Texture]:
    yield from in_memory(each for each in materials if isinstance(each, Brdf | Btf))
    paths = []
    for each in materials:
        if isinstance(each, Brdf | Btf):
            continue
        path = path_of(each)
        if path is None or not path.exists():
            opened(each)  # says what is wrong
        paths.append(path)
    if paths:
        yield from read_materials(find_materials(filter(None, paths)), _refuse)


def _refuse(path: Path, error: NacreError) -> None:
    raise error


def _title(materials: Sequence[Given]) -> str:
    names = {
        each.name if isinstance(each, Brdf | Btf) else (path_of(each) or Path()).stem
        for each in materials
    }
    return next(iter(names)) or "Material" if len(names) == 1 else "Materials"
