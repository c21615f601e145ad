"""Materials of files and folders for one page."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from nacre.analytic.model import AnalyticBrdf
from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.errors import FormatError, NacreError
from nacre.export.textures import HeightField
from nacre.export.textures.atlas import encoded
from nacre.formats import formats, identify, load, load_brdf
from nacre.io.files import PathLike
from nacre.neural.nbrdf import NeuralBrdf
from nacre.viewer.content import Entry

_NETWORK, _MEASURED = "Network", "Measured"
_HEIGHTS, _ENCODED = ".exr", ".safetensors"


@dataclass(frozen=True)
class Shown:
    """A file to show: where it is, and under which heading."""

    path: Path
    group: str


@dataclass(frozen=True)
class Texture:
    """An encoded texture, and its height field where it has one."""

    btf: Btf
    heights: HeightField | None


def find_materials(paths: Iterable[PathLike]) -> list[Shown]:
    """The files among `paths`, and in the folders among them, at any depth, all materials.

    What is hidden (its name starts with a dot) is left out; links to folders are not followed. Of
    a folder, files below it stand under the names of their folders.

    Raises
    ------
    FormatError
        If a path does not exist, or a folder holds no material.
    """
    found: dict[Path, Shown] = {}
    for path in map(Path, paths):
        if not path.exists():
            raise FormatError(f"{path}: does not exist")
        listed = list(_below(path)) if path.is_dir() else [Shown(path, "")]
        if not listed:
            raise FormatError(f"{path}: holds no material")
        for shown in listed:
            found.setdefault(shown.path.resolve(), shown)
    return list(found.values())


def _below(root: Path) -> Iterator[Shown]:
    endings = {ending for entry in formats() for ending in entry.extensions}
    for name, folders, files in os.walk(root):
        folders[:] = sorted(folder for folder in folders if not folder.startswith("."))
        for file in sorted(files):
            path = Path(name) / file
            if file.startswith(".") or path.suffix.lower() not in endings or not path.is_file():
                continue
            if path.suffix == _HEIGHTS and path.with_suffix(_ENCODED).exists():
                continue
            try:
                identify(path)
            except FormatError:
                continue
            yield Shown(path, path.parent.relative_to(root).as_posix().removeprefix("."))


def read_materials(
    files: Iterable[Shown], left_out: Callable[[Path, NacreError], None] | None = None
) -> Iterator[Entry | Texture]:
    """Reflectances, each with all files of its name in its folder as forms of it; and textures.

    Textures have to be encoded; a gray image of the same name (`.exr`) is the height field of one.

    `gold.binary`, `gold.safetensors` and `gold.mtlx` are one material: measured, a network, and
    OpenPBR. Networks come first; errors are told against what was measured, or else the first.

    Parameters
    ----------
    left_out
        Called with every file that cannot be read, which is then passed over; where None, its error
        is raised.
    """
    together: dict[Path, list[Shown]] = {}
    for shown in files:
        together.setdefault(shown.path.with_suffix(""), []).append(shown)
    for stem, several in together.items():
        forms: dict[str, Brdf] = {}
        names = []
        for shown in several:
            try:
                material = load(shown.path)
                if isinstance(material, Btf) and material.texel_count == 1:
                    material = load_brdf(shown.path)
                if isinstance(material, Btf):
                    encoded(material)  # or no page holds it
            except NacreError as error:
                if left_out is None:
                    raise
                left_out(shown.path, error)
                continue
            if isinstance(material, Btf):
                image = shown.path.with_suffix(_HEIGHTS)
                yield Texture(material, HeightField.read(image) if image.is_file() else None)
                continue
            label = _label(material)
            label = label if label not in forms else f"{label} ({shown.path.suffix})"
            forms[label] = material
            names.append(material.name)
        if forms:
            ordered = dict(sorted(forms.items(), key=lambda form: form[0] != _NETWORK))
            name = next(filter(None, names), None) or stem.name
            reference = next((label for label in (_MEASURED, *ordered) if label in ordered), "")
            yield Entry(name, ordered, several[0].group, {"File": stem.name}, reference)


def _label(brdf: Brdf) -> str:
    if isinstance(brdf, NeuralBrdf):
        return _NETWORK
    return brdf.model if isinstance(brdf, AnalyticBrdf) else _MEASURED
