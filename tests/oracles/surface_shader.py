"""Surface shaders of MaterialX under one light without extent, in the GLSL that it generates."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nacre.array import Weights
from nacre.errors import require
from tests.oracles.runners import opengl
from tests.oracles.runners.materialx import library, positions

_WIDTH = 1024  # of pictures of points

_FAR = 1e6  # the viewer, so that all points are seen from +z


class SurfaceShader:
    """The material of a document, seen from +z; what its nodes have as values can be set.

    Parameters
    ----------
    document
        Text of a `.mtlx` with one material.
    plain_mixes
        Whether `mix` nodes of BSDFs are evaluated as such. By default MaterialX replaces them by
        sums of weighted BSDFs, which let other light through where a mix is an input of a mix.

    Raises
    ------
    RuntimeError
        If MaterialX finds the document not valid, or its shaders do not compile.
    """

    def __init__(self, document: str, *, plain_mixes: bool = False) -> None:
        sources = _generated(document, plain_mixes)
        self._gl = opengl.context()
        try:
            self._program = self._gl.program(vertex_shader=sources[0], fragment_shader=sources[1])
        except Exception as error:  # moderngl's own kind
            raise RuntimeError(str(error)) from error
        for key in self._program:
            if key.endswith("Matrix"):
                self._program[key].write(np.eye(4, dtype=np.float32))
        self._set("u_viewPosition", (0.0, 0.0, _FAR))
        self._set("u_numActiveLightSources", 1)
        self._set("u_lightData[0].type", 1)
        self._set("u_lightData[0].color", (1.0, 1.0, 1.0))
        self._set("u_lightData[0].intensity", 1.0)

    def _set(self, key: str, value: Any) -> None:
        self._program[key].value = value

    def radiance(
        self, values: Mapping[str, Any], light: Weights, normals: Weights, tangents: Weights
    ) -> Weights:
        """f_r times the cosine of the light, shape (n, 3).

        Parameters
        ----------
        values
            Inputs by the name of their node, _ and their own: numbers, or three for colors.
        light
            Direction to the light, shape (3,).
        normals, tangents
            Of the points, shapes (n, 3), perpendicular to each other.
        """
        for key, value in values.items():
            self._set(key, value)
        self._set("u_lightData[0].direction", tuple((-light).tolist()))
        streams = {"position": positions(len(normals)), "normal": normals, "tangent": tangents}
        points = self._gl.vertex_array(
            self._program,
            [
                (self._gl.buffer(np.ascontiguousarray(stream, np.float32)), "3f", f"i_{key}")
                for key, stream in streams.items()
                if f"i_{key}" in self._program
            ],
        )
        texture = self._gl.texture((_WIDTH, -(-len(normals) // _WIDTH)), 4, dtype="f4")
        picture = self._gl.framebuffer([texture])
        picture.use()
        points.render(self._gl.POINTS)
        data = np.frombuffer(picture.read(components=4, dtype="f4"), np.float32)
        return data.reshape(-1, 4)[: len(normals), :3]


def _generated(text: str, plain_mixes: bool) -> list[str]:
    """Sources of the vertex shader and the pixel shader; values are uniforms.

    Colors of other spaces are converted to linear Rec. 709 by MaterialX's own transforms.
    """
    mx = require("MaterialX", "dev")
    shading = require("MaterialX.PyMaterialXGenShader", "dev")
    document = mx.createDocument()
    document.setDataLibrary(library())
    mx.readFromXmlString(document, text)
    valid, message = document.validate()
    if not valid:
        raise RuntimeError(message)
    (material,) = document.getMaterialNodes()
    writer = require("MaterialX.PyMaterialXGenGlsl", "dev").GlslShaderGenerator.create()
    colors = shading.DefaultColorManagementSystem.create(writer.getTarget())
    colors.loadLibrary(library())
    writer.setColorManagementSystem(colors)
    context = shading.GenContext(writer)
    context.registerSourceCodeSearchPath(mx.getDefaultDataSearchPath())
    options = context.getOptions()
    options.hwSrgbEncodeOutput = False
    # Older releases have no such option, and only plain mixes.
    if plain_mixes and hasattr(options, "premultipliedBsdfAdd"):
        options.premultipliedBsdfAdd = False
    options.targetColorSpaceOverride = "lin_rec709"
    options.hwMaxActiveLightSources = 1
    kinds = shading.HwSpecularEnvironmentMethod
    options.hwSpecularEnvironmentMethod = kinds.SPECULAR_ENVIRONMENT_NONE
    light = library().getNodeDef("ND_directional_light")
    shading.HwShaderGenerator.bindLightShader(light, 1, context)
    written = writer.generate("surface", material, context)
    vertex, pixel = (written.getSourceCode(stage) for stage in ("vertex", "pixel"))
    # Without surroundings the generator uses this uniform of theirs, but does not declare it.
    return [
        vertex,
        pixel.replace("\nuniform ", "\nuniform bool u_refractionTwoSided;\nuniform ", 1),
    ]
