"""Blender: a material of its Principled node, made by a script and marked as an asset."""

from __future__ import annotations

from collections.abc import Mapping

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.export.blender_closures import content, script
from nacre.export.target import Target
from nacre.export.text import facts


class PrincipledScript(Target):
    """See :mod:`nacre.export.principled`."""

    title = "Blender: a script that makes an asset of the Principled node"
    model = "principled"

    def files(self, material: Brdf | Btf, name: str) -> Mapping[str, bytes]:
        """See :class:`nacre.export.target.Target`; what is no Principled material is fitted."""
        found = self.of_model(material)
        about = [
            *facts(found).values(),
            "",
            "Blender 4.2 to 5: blender --python this file, or open it in the text editor and run.",
            "A material is added as an asset; one that this added before gets its values again.",
        ]
        pieces = "reading", "nodes", "asset"
        call = f'make_asset(read(MATERIAL, "{name}"))'
        return {f"{name}.py": script(about, pieces, call, content(found, name))}
