"""What an export target is, and the registry of targets."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import ClassVar

from nacre.analytic import MODELS, AnalyticBrdf
from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.errors import NacreError
from nacre.neural.spectral import SpectralBrdf
from nacre.registry import Registry
from nacre.runtime.progress import Progress
from nacre.standard import fitted

TABLES, WIDE, TEXTURES = "tables", "wide networks", "textures"


class Target(abc.ABC):
    """A language or tool that materials are exported to."""

    title: ClassVar[str]
    """Describes the target in a list."""
    holds: ClassVar[frozenset[str]] = frozenset()
    """Which of :data:`TABLES`, :data:`WIDE` and :data:`TEXTURES` it holds, besides small networks
    and formulas."""
    model: ClassVar[str] = ""
    """If it holds only one analytic model, its name in :data:`nacre.analytic.MODELS`; the model is
    fitted to any other reflectance."""

    @abc.abstractmethod
    def files(self, material: Brdf | Btf, name: str) -> Mapping[str, bytes]:
        """The contents of the material's files, by name.

        `name` is the material's identifier (see :func:`nacre.targets.identifier`); the names of
        files and of everything they define begin with it. Raises NacreError if the target cannot
        hold the material; the message says why, and which can.
        """

    def held(self, brdf: Brdf, progress: Progress | None = None) -> Brdf:
        """A reflectance as the target holds it; NacreError if the target's model cannot fit it."""
        return self.of_model(brdf, progress) if self.model else brdf

    def of_model(self, material: Brdf | Btf, progress: Progress | None = None) -> AnalyticBrdf:
        """The material as the target's :attr:`model`, fitted if it is not one already.

        Raises NacreError if it is no reflectance in RGB, or cannot be fitted.
        """
        return fitted(self.reflectance(material), MODELS.find(self.model), progress)

    def reflectance(self, material: Brdf | Btf) -> Brdf:
        """The material, if it is a reflectance in RGB, or a spectral network in its channels;
        NacreError otherwise.
        """
        name = material.name or "this material"
        if not isinstance(material, Brdf):
            raise NacreError(f"{name}: is a texture, and this holds reflectances{other(TEXTURES)}")
        if isinstance(material, SpectralBrdf):
            return material.color()
        if material.wavelengths is not None:
            raise NacreError(
                f"{name}: is spectral, and all targets hold RGB: fit a network to its colors first "
                "(nacre fit)"
            )
        return material


TARGETS: Registry[type[Target]] = Registry(
    "nacre.targets",
    "export target",
    {
        "c": "nacre.targets.c:C",
        "glsl": "nacre.targets.glsl:Glsl",
        "slang": "nacre.targets.slang:Slang",
        "wgsl": "nacre.targets.wgsl:Wgsl",
        "three": "nacre.targets.three:Three",
        "brdf": "nacre.targets.brdf_explorer:BrdfExplorer",
        "onnx": "nacre.targets.onnx:Onnx",
        "pytorch": "nacre.targets.pytorch:PyTorch",
        "npy": "nacre.targets.published:Npy",
        "h5": "nacre.targets.published:H5",
        "osl": "nacre.targets.osl:Osl",
        "materialx": "nacre.targets.materialx:MaterialX",
        "osl-closures": "nacre.targets.osl_closures:OslClosures",
        "materialx-closures": "nacre.targets.materialx_closures:MaterialXClosures",
        "openpbr": "nacre.targets.standard:MaterialXSurface",
        "usda": "nacre.targets.standard:Usda",
        "gltf": "nacre.targets.standard:Glb",
        "mdl": "nacre.targets.standard:Mdl",
        "principled": "nacre.targets.blender:PrincipledScript",
        "blender-closures": "nacre.targets.blender:BlenderClosures",
        "blender-addon": "nacre.targets.blender:BlenderAddon",
    },
    base=Target,
)
"""Targets by name; packages add theirs by an entry point in `nacre.targets`."""


def other(what: str) -> str:
    """The end of an error message: the targets that do hold something."""
    names = [name for name, target in TARGETS.members() if what in target.holds]
    return f"; export it --to {', '.join(names[:-1])} or {names[-1]}" if names else ""
