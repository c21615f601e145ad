"""Standard materials as files that nacre can also read: MaterialX, USD, glTF and MDL."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.formats import load_brdf, save
from nacre.runtime.progress import Progress
from nacre.targets.target import TABLES, WIDE, Target
from nacre.targets.text import preamble

_MDL = """\
mdl 1.2;

{preamble}

import ::df::*;

// The measured table beside this file, as the scattering of a surface.
export material {name}() = material(
    surface: material_surface(
        scattering: df::measured_bsdf(measurement: bsdf_measurement("./{name}.mbsdf"))));
"""


class StandardTarget(Target):
    """Files in a format that nacre writes and reads."""

    ending: ClassVar[str]

    def held(self, brdf: Brdf, progress: Progress | None = None) -> Brdf:
        fit = super().held(brdf, progress)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, f"material{self.ending}")
            save(fit, path)
            return load_brdf(path).replaced(name=brdf.name, source=brdf.source)

    def files(self, material: Brdf | Btf, name: str) -> Mapping[str, bytes]:
        brdf = super().held(self.reflectance(material))
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, f"{name}{self.ending}")
            save(brdf, path)
            return {path.name: path.read_bytes()}


class MaterialXSurface(StandardTarget):
    title = "MaterialX: a document of one OpenPBR surface"
    ending, model = ".mtlx", "openpbr"


class Usda(StandardTarget):
    title = "USD: an OpenPBR surface, and what UsdPreviewSurface has of it, as text"
    ending, model = ".usda", "openpbr"


class Glb(StandardTarget):
    title = "glTF: a sphere in a material with all ratified extensions of reflection"
    ending, model = ".glb", "gltf"


class Mdl(StandardTarget):
    title = "MDL: a module of one material, and the measured table that it shows"
    holds = frozenset({TABLES, WIDE})
    ending = ".mbsdf"

    def files(self, material: Brdf | Btf, name: str) -> Mapping[str, bytes]:
        brdf = self.reflectance(material)
        about = "\n".join(f"// {line}".rstrip() for line in preamble(brdf))
        module = _MDL.format(preamble=about, name=name)
        return {f"{name}.mdl": module.encode(), **super().files(brdf, name)}
