"""Materials from files and folders for the viewer's page."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from nacre.analytic.model import AnalyticBrdf
from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.errors import FormatError, NacreError
from nacre.formats import formats, identify, is_measured, load, load_brdf
from nacre.io.files import PathLike
from nacre.io.names import stem
from nacre.io.packed import inner_names
from nacre.mitsuba.environment import Environment
from nacre.neural.nbrdf import NeuralBrdf
from nacre.runtime.progress import Progress, silent
from nacre.targets.textures import HeightField
from nacre.targets.textures.shader_texture import encoded
from nacre.viewer.content import Content, Entry, own_environments
from nacre.viewer.space import add_space
from nacre.workflows.sources import Source, files_below, gather

_NETWORK, _MEASURED = "Network", "Measured"
_HEIGHTS, _ENCODED = ".exr", ".safetensors"


@dataclass(frozen=True)
class Texture:
    """An encoded texture, and its height field if it has one."""

    btf: Btf
    heights: HeightField | None


def find_materials(paths: Iterable[PathLike]) -> list[Source]:
    """The files among `paths`, and all materials in the folders among them, at any depth.

    Hidden files are left out, and links to folders not followed.

    Raises
    ------
    FormatError
        If a path does not exist, or a folder cannot be listed or holds no material.
    """
    return gather(paths, _materials)


def _materials(root: Path) -> list[Source]:
    endings = {ending for entry in formats() for ending in entry.extensions}

    def ends(path: Path) -> bool:
        return any(Path(name).suffix.lower() in endings for name in inner_names(path))

    found = [
        source
        for source in files_below(root)
        if ends(source.path) and not _is_relief(source.path) and _is_known(source.path)
    ]
    if not found:
        raise FormatError(f"{root}: holds no material")
    return found


def _is_relief(path: Path) -> bool:
    """Whether an image is the height field of an encoded texture beside it."""
    return path.suffix == _HEIGHTS and path.with_suffix(_ENCODED).exists()


def _is_known(path: Path) -> bool:
    """Whether a file holds a material, or should: then reading it says what is wrong."""
    try:
        identify(path, by_ending=False)
    except FormatError:
        return is_measured(path)
    return True


def read_materials(
    files: Iterable[Source], left_out: Callable[[Path, NacreError], None]
) -> Iterator[Entry | Texture]:
    """Reflectances, each with the files of its name in its folder as its forms; and textures.

    `gold.binary`, `gold.safetensors` and `gold.mtlx` are one material: measured, a network, and
    OpenPBR. Networks come first; errors are against the measurement, or else the first form.
    Subfolders become groups. Textures must be encoded; a gray image of the same name (`.exr`) is
    the height field. `left_out` is called with every file that cannot be read.
    """
    together: dict[Path, list[Source]] = {}
    for source in files:
        together.setdefault(source.path.with_name(stem(source.path)), []).append(source)
    for place, several in together.items():
        forms: dict[str, Brdf] = {}
        names = []
        for source in several:
            try:
                material = load(source.path)
                if isinstance(material, Btf) and material.texel_count == 1:
                    material = load_brdf(source.path)
                if isinstance(material, Btf):
                    encoded(material)  # a page cannot show others
            except NacreError as error:
                left_out(source.path, error)
                continue
            if isinstance(material, Btf):
                image = source.path.with_suffix(_HEIGHTS)
                yield Texture(material, HeightField.read(image) if image.is_file() else None)
                continue
            label = _label(material)
            label = label if label not in forms else f"{label} ({source.path.suffix})"
            forms[label] = material
            names.append(material.name)
        if forms:
            name = next(filter(None, names), None) or place.name
            yield _entry(name, forms, _group(several[0]), {"File": place.name})


def in_memory(materials: Iterable[Brdf | Btf]) -> Iterator[Entry | Texture]:
    """Materials as :func:`read_materials` yields them: reflectances of one name are its forms.

    Raises NacreError for a texture that is not encoded.
    """
    together: dict[str, list[Brdf]] = {}
    for index, material in enumerate(materials, 1):
        if isinstance(material, Btf):
            encoded(material)
            yield Texture(material, None)
        else:
            together.setdefault(material.name or f"material {index}", []).append(material)
    for name, several in together.items():
        forms: dict[str, Brdf] = {}
        for brdf in several:
            label = _label(brdf)
            forms[label if label not in forms else f"{label} {len(forms) + 1}"] = brdf
        yield _entry(name, forms)


def _entry(
    name: str, forms: Mapping[str, Brdf], group: str = "", facts: Mapping[str, str] | None = None
) -> Entry:
    """A material with its forms, the network first, and errors against the measurement."""
    ordered = dict(sorted(forms.items(), key=lambda form: form[0] != _NETWORK))
    reference = next((label for label in (_MEASURED, *ordered) if label in ordered), "")
    return Entry(name, ordered, group, facts or {}, reference)


def page_content(
    materials: Iterable[Entry | Texture],
    *,
    environments: Sequence[Environment] = (),
    mapped: bool = False,
    heights: HeightField | None = None,
    notice: str | None = None,
    total: int = 0,
    progress: Progress = silent,
) -> tuple[Content, int]:
    """What a page holds, and the number of materials and textures on it.

    Parameters
    ----------
    materials
        From :func:`read_materials` or :func:`in_memory`.
    environments
        Lights to offer; the built-in ones if there are none.
    mapped
        Add a map for exploring what lies between the materials.
    heights
        For parallax of the only texture.
    notice
        Text for the foot of the page.
    total
        Number of materials, for `progress`.

    Raises
    ------
    NacreError
        If there is no material, a page cannot show one, or `heights` or `mapped` cannot be used.
    """
    content = Content(environments or own_environments(), code=True)
    entries: list[Entry] = []
    textures: list[Texture] = []
    for material in materials:
        progress("reading", len(entries) + len(textures), total, "")
        if isinstance(material, Texture):
            textures.append(material)
        else:
            content.add(material)
            entries.append(material)
    if heights is not None and len(textures) != 1:
        raise NacreError(f"--height-field: is for one texture, not for {len(textures)}")
    for texture in textures:
        content.add_texture(texture.btf, heights or texture.heights, progress=progress)
    if not entries and not textures:
        raise NacreError("no material could be read")
    if mapped and not add_space(content, entries, progress=progress):
        raise NacreError(f"--map: {len(entries)} materials are too few, or too many have no code")
    if notice is not None:
        content.facts["notice"] = notice
    return content, len(entries) + len(textures)


def _group(source: Source) -> str:
    folder = source.relative.parent.as_posix()
    return "" if folder == "." else folder


def _label(brdf: Brdf) -> str:
    if isinstance(brdf, NeuralBrdf):
        return _NETWORK
    return brdf.model if isinstance(brdf, AnalyticBrdf) else _MEASURED
