"""ONNX: one model each for evaluation, density and the sampler.

They are three files because a session of onnxruntime computes all outputs of its model and asks for
all inputs.
"""

from __future__ import annotations

from collections.abc import Mapping

from nacre.brdf import Brdf
from nacre.btf import Btf
from nacre.errors import NacreError
from nacre.targets.onnx_graph import Graph
from nacre.targets.program import program
from nacre.targets.target import TABLES, TEXTURES, WIDE
from nacre.targets.textures.atlas import TextureAtlas
from nacre.targets.textures.onnx import texture_models
from nacre.targets.textures.shader_texture import ShaderTexture
from nacre.targets.textures.target import TextureTarget


class Onnx(TextureTarget):
    title = "ONNX models for onnxruntime, in Python, C++ and browsers"
    holds = frozenset({TABLES, WIDE, TEXTURES})

    def reflectance_files(self, brdf: Brdf, name: str) -> Mapping[str, bytes]:
        found = {}
        for each, function in program(brdf).items():
            graph = Graph()
            inputs = [graph.value(key, count) for key, count in function.parameters.items()]
            outputs = graph.function(function)
            found[f"{name}_{each}.onnx"] = graph.model(brdf, f"{name}_{each}", inputs, outputs)
        return found

    def texture_files(self, texture: Btf, atlas: ShaderTexture, name: str) -> Mapping[str, bytes]:
        if self.heights is not None:
            raise NacreError("has no parallax; glsl, wgsl, slang and three have")
        if not isinstance(atlas, TextureAtlas):
            raise NacreError("takes no bytes per texel; glsl, wgsl, slang and three do")
        return texture_models(texture, atlas, name)
