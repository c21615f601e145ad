"""`nacre.info`: what a material or a file is, as a mapping."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from nacre.verbs.material import Given, label, opened, path_of
from nacre.verbs.tables import html_table, text_table, value_text
from nacre.workflows.inspection import Inspection, inspect, inspect_material
from nacre.workflows.sentences import Sentences

if TYPE_CHECKING:
    from nacre.measured.textures.image_folder import Quantity


@dataclass(frozen=True, repr=False, eq=False)
class Facts(Mapping[str, Any]):
    """Facts by name, in the order to show them, as `nacre info -v` prints them."""

    title: str
    sentences: Sentences
    kind: str  # "brdf", "btf", "codec", "basis", "code" or "map"
    facts: Mapping[str, Any]
    units: Mapping[str, str]  # of the facts that have one

    def __getitem__(self, name: str) -> Any:
        return self.facts[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.facts)

    def __len__(self) -> int:
        return len(self.facts)

    def _rows(self) -> list[tuple[str, str, str]]:
        units = ((name, self.units.get(name, "")) for name in self.facts)
        return [(name, value_text(self.facts[name]), unit and f"[{unit}]") for name, unit in units]

    def __repr__(self) -> str:
        rows = (("", name, f"{value}  {unit}") for name, value, unit in self._rows())
        return "\n".join((self.title, *self.sentences, text_table(rows)))

    def _repr_html_(self) -> str:
        return html_table(self._rows())


def info(material: Given, *, physics: bool = True, pixels: Quantity | None = None) -> Facts:
    """What a material is, and whether a reflectance is physical.

    Parameters
    ----------
    material
        A reflectance or a texture, its path, or the name of one that comes with nacre; or the path
        of another file that nacre writes: a code, a latent basis, a texture codec, a map of texels.
    physics
        Compute energy, reciprocity and anisotropy of a reflectance.
    pixels
        Meaning of the pixels in a folder of images, "reflectance" or "radiance".

    Returns
    -------
    Facts
        A mapping: `info(...)["memory bytes"]`. Angles are in degrees; `units` has the units.

    Raises
    ------
    FormatError
        If a file cannot be read or is of no known kind.

    Examples
    --------
    >>> import nacre
    >>> nacre.info("rgl:paper_white", physics=False)["weights"]
    675
    """
    path = path_of(material)
    if path is not None:
        found = inspect(path, physics=physics, pixels=pixels)
        return _facts(label(material), found)
    brdf = opened(material, quantity=pixels)
    found = inspect_material(brdf, physics=physics)
    return _facts(label(brdf), found)


def _facts(title: str, found: Inspection) -> Facts:
    return Facts(title, found.sentences, found.kind, found.facts, found.units)
