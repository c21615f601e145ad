"""Export to a place, such as Blender: the best of all representations that it can hold."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from nacre import neural
from nacre.analytic import AnalyticBrdf
from nacre.brdf import Brdf
from nacre.errors import NacreError, printable
from nacre.io.files import PathLike
from nacre.metrics import compare
from nacre.metrics.comparison import Comparison
from nacre.neural import NeuralBrdf
from nacre.runtime.progress import Progress, named, silent
from nacre.targets import TARGETS, identifier, safe
from nacre.targets.files import write_files


@dataclass(frozen=True)
class Representation:
    """What a material can become in a place."""

    title: str
    target: str  # one of nacre.targets.TARGETS
    opening: str  # how to open the files, in a sentence about {name}
    network: bool = False  # the target takes networks and formulas: fit one to other materials


_OPENPBR = Representation(
    "OpenPBR", "openpbr", "Import {name}.mtlx where the tool takes MaterialX."
)
_USD = Representation(
    "OpenPBR in USD",
    "usda",
    "Open or reference {name}.usda; renderers without MaterialX show its UsdPreviewSurface.",
)
_GLTF = Representation(
    "glTF", "gltf", "Import {name}.glb, a sphere; its material goes onto other objects."
)

PLACES: Mapping[str, tuple[Representation, ...]] = {
    "blender": (
        Representation(
            "closure mixture",
            "blender-addon",
            "Install nacre_blender.zip (Preferences > Add-ons > Install from Disk), then File > "
            "Import > nacre material: {name}.json.",
        ),
        Representation("Principled", "principled", "Run blender --python {name}.py."),
        _GLTF,
    ),
    "unreal": (_OPENPBR, _GLTF),
    "omniverse": (
        Representation(
            "measured table",
            "mdl",
            "Put {name}.mdl and {name}.mbsdf into a folder of the MDL search path.",
        ),
        _USD,
    ),
    "web": (
        Representation(
            "network",
            "three",
            "In three.js: import createMaterial of {name}.js; see docs/guide/export.md.",
            network=True,
        ),
        _GLTF,
    ),
    "usd": (_USD,),
}
"""The representations that each place can hold, by its name."""


@dataclass(frozen=True)
class Candidate:
    """A representation of one material, compared with it."""

    representation: Representation
    held: Brdf  # the material as the place shows it
    files: Mapping[str, bytes]  # contents by name
    comparison: Comparison

    @property
    def nbytes(self) -> int:
        return sum(map(len, self.files.values()))

    @property
    def flip(self) -> float:
        """FLIP error in [0, 1], the mean over both lights."""
        errors = [light.errors.flip for light in self.comparison.lights]
        return sum(errors) / len(errors)


def export_to_place(
    material: Brdf,
    place: str,
    output: PathLike = "",
    *,
    name: str = "",
    progress: Progress | None = None,
) -> tuple[list[Candidate], list[Path]]:
    """Write what shows a material best in a place, with a readme of three lines.

    Parameters are those of :func:`place_contents`, and `output`, the folder to write into. Returns
    the candidates and the written files.

    Raises NacreError if no representation can hold the material, or a file cannot be written.
    """
    found, contents = place_contents(material, place, name=name, progress=progress)
    return found, write_files(contents, f"{output or '.'}/")


def place_contents(
    material: Brdf, place: str, *, name: str = "", progress: Progress | None = None
) -> tuple[list[Candidate], Mapping[str, bytes]]:
    """The files that show a material best in a place, with a readme of three lines.

    Parameters
    ----------
    material
        Any reflectance.
    place
        One of :data:`PLACES`.
    name
        Prefix of the file names, made an :func:`nacre.targets.identifier`; the material's if empty.

    Returns
    -------
    candidates
        All representations that could be made, the best first.
    contents
        The files of the best by name.

    Raises
    ------
    NacreError
        If no representation can hold the material.
    """
    identified = identifier(name or material.name)
    report, found, problems = progress or silent, [], []
    for representation in PLACES[place]:
        try:
            stage = named(report, representation.title)
            found.append(_candidate(material, representation, identified, stage))
        except NacreError as error:
            problems.append(f"{representation.title}: {error}")
    if not found:
        raise NacreError(f"{place}: {'; '.join(problems)}")
    found.sort(key=lambda candidate: candidate.flip)
    best = found[0]
    readme = {f"{identified}-readme.txt": _readme(material, best, identified).encode()}
    return found, {**best.files, **readme}


def _candidate(
    material: Brdf, representation: Representation, name: str, progress: Progress
) -> Candidate:
    target = TARGETS.find(representation.target)()
    brdf = target.reflectance(material)
    if representation.network and not isinstance(brdf, NeuralBrdf | AnalyticBrdf):
        held: Brdf = neural.fit(brdf, progress=progress)
    else:
        held = target.held(brdf, progress)
    files = target.files(held, name)
    return Candidate(representation, held, files, compare(material, held))


def _readme(material: Brdf, candidate: Candidate, name: str) -> str:
    lights = [
        f"{light.light}: FLIP {light.errors.flip:.3f}, PSNR {light.errors.psnr:.1f} dB"
        for light in candidate.comparison.lights
    ]
    source = material.source or {}
    of = f"from {safe(source['file'])}" if source.get("file") else "from an unknown source"
    terms = f"; terms: {printable(safe(source['terms']))}" if source.get("terms") else ""
    return (
        f"{candidate.representation.opening.format(name=name)}\n"
        f"Error of this {candidate.representation.title} (spheres, nacre compare): "
        f"{'; '.join(lights)}.\n"
        f"Written by nacre export {of}{terms}.\n"
    )
