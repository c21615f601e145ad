"""three.js: a module that makes a material for either of its renderers."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from importlib import resources

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.targets.glsl import Glsl
from nacre.targets.text import preamble
from nacre.targets.textures.shader_texture import ShaderTexture
from nacre.targets.textures.source import texture_facts
from nacre.targets.textures.target import TextureTarget
from nacre.targets.three_textures import texture_values
from nacre.targets.wgsl import Wgsl

REVISION = "three.js r187"
"""What exports were written for and tested with."""
REFLECTANCE = {"ARRAYS": "{}", "SAMPLES": "32", "LOADER": "", "BEGIN": ""}
"""Places in the template that are the same for all reflectances."""


class Three(TextureTarget):
    """Fills in the template `three.js`."""

    title = "three.js: a module with a material for WebGLRenderer and WebGPURenderer"

    def reflectance_files(self, brdf: Brdf, name: str) -> Mapping[str, bytes]:
        values = {
            "PREAMBLE": _comments(preamble(brdf)),
            "ANISOTROPIC": json.dumps(not brdf.isotropic),
            **REFLECTANCE,
            "GLSL": "\n\n".join(Glsl().written(brdf, name).values()),
            "WGSL": "\n\n".join(Wgsl().written(brdf, name).values()),
        }
        return {f"{name}.js": _module(name, values)}

    def texture_files(self, texture: Btf, atlas: ShaderTexture, name: str) -> Mapping[str, bytes]:
        head = _comments([*preamble(texture), *texture_facts(texture, atlas, name)])
        module = _module(name, {**texture_values(atlas, name), "PREAMBLE": head})
        return {f"{name}.js": module, **atlas.files(name)}


def _comments(lines: Sequence[str]) -> str:
    return "\n".join(f"// {line}".rstrip() for line in lines)


def _module(name: str, values: Mapping[str, str]) -> bytes:
    given = {**values, "REVISION": REVISION, "NAME": name}
    template = resources.files("nacre.targets").joinpath("three.js").read_text("utf-8")
    # In one pass: a value may contain the name of a place.
    return re.sub(r"NACRE_([A-Z]+)", lambda place: given[place[1]], template).encode()
