"""MaterialX nodes: shaders that its generators write, in OpenGL and in Cycles."""

from __future__ import annotations

import abc
import functools
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from nacre.array import Weights
from nacre.errors import NacreError, require
from tests.oracles import blender
from tests.oracles.runner import Runner, best_rate
from tests.oracles.runners import opengl

_WIDTH = 1024  # pixels

_DIRECTIONS = "lightdir", "viewdir"
_NODES: Mapping[str, tuple[str, tuple[str, str], Mapping[str, str]]] = {
    "eval": ("reflectance", _DIRECTIONS, {"out": "color3"}),
    "pdf": ("pdf", _DIRECTIONS, {"out": "float"}),
    "sample": ("sample", ("viewdir", "u"), {"lightdir": "vector3", "pdf": "float"}),
}
"""Node of each function, its inputs that are `a` and `b`, and types of its outputs."""

_HEADER = "mx_funcs.h"  # of MaterialX, which shaders in OSL include

_FRAME = {"normal": (0.0, 0.0, 1.0), "tangent": (1.0, 0.0, 0.0)}


class _Generated(Runner):
    """A shader for each output of a node."""

    target = "materialx"

    def missing(self) -> str | None:
        try:
            library()
        except NacreError as error:
            return str(error)
        return None

    @abc.abstractmethod
    def prepared(
        self,
        files: Mapping[str, bytes],
        name: str,
        function: str,
        output: str,
        a: Weights,
        b: Weights,
    ) -> Callable[[], Weights]:
        """What computes an output of the node of a function: floats of shape (n, 3 or more)."""

    def run(
        self, files: Mapping[str, bytes], name: str, function: str, a: Weights, b: Weights
    ) -> Weights:
        parts = [
            self.prepared(files, name, function, output, a, b)()[:, : 1 if kind == "float" else 3]
            for output, kind in _NODES[function][2].items()
        ]
        found = np.concatenate(parts, axis=1)
        return found[:, 0] if function == "pdf" else found


class OpenGl(_Generated):
    """Points, each of which has a pair as its colors and is a pixel."""

    title = "generated GLSL, OpenGL"
    generator: ClassVar[str] = "GenGlsl.Glsl"

    def missing(self) -> str | None:
        return super().missing() or opengl.missing()

    def prepared(
        self,
        files: Mapping[str, bytes],
        name: str,
        function: str,
        output: str,
        a: Weights,
        b: Weights,
    ) -> Callable[[], Weights]:
        with tempfile.TemporaryDirectory() as folder:
            document, element = graph(files, name, function, output, Path(folder))
            sources = generated(self.generator, document, element, ("vertex", "pixel"))
        frame = {f"i_{key}": np.broadcast_to(vector, a.shape) for key, vector in _FRAME.items()}
        return drawing(sources, {"i_color_0": a, "i_color_1": b, **frame}, {})

    def rate(self, files: Mapping[str, bytes], name: str, a: Weights, b: Weights) -> float:
        return best_rate(self.prepared(files, name, "eval", "out", a, b), len(a))


class Cycles(_Generated):
    """The shaders in OSL, as emission of a plane whose pixels are pairs."""

    title = "generated OSL, Cycles"

    def missing(self) -> str | None:
        return super().missing() or blender.missing()

    def prepared(
        self,
        files: Mapping[str, bytes],
        name: str,
        function: str,
        output: str,
        a: Weights,
        b: Weights,
    ) -> Callable[[], Weights]:
        shader = self._shader(files, name, function, output)
        return lambda: blender.shade(shader, a, b)[0][0]

    def rate(self, files: Mapping[str, bytes], name: str, a: Weights, b: Weights) -> float:
        return len(a) / blender.shade(self._shader(files, name, "eval", "out"), a, b)[1]

    def _shader(self, files: Mapping[str, bytes], name: str, function: str, output: str) -> str:
        mx = require("MaterialX", "dev")
        with tempfile.TemporaryDirectory() as folder:
            document, element = graph(files, name, function, output, Path(folder), parameters=True)
            (shader,) = generated("GenOsl.Osl", document, element, ("pixel",))
        place = mx.getDefaultDataSearchPath().find(f"libraries/stdlib/genosl/include/{_HEADER}")
        return shader.replace(f'"{_HEADER}"', f'"{place.asString()}"')


def drawing(
    sources: Sequence[str], streams: Mapping[str, Weights], uniforms: Mapping[str, Sequence[float]]
) -> Callable[[], Weights]:
    """What draws points, each a pixel, and returns their colors of shape (n, 4).

    Parameters
    ----------
    sources
        Of the vertex shader and the pixel shader.
    streams
        Attributes of the points, shapes (n, 3); positions are those of the pixels: see
        :func:`positions`.
    uniforms
        Vectors of three numbers; matrices are the identity.

    Raises
    ------
    RuntimeError
        If the shaders do not compile; with the words of the compiler.
    """
    gl, count = opengl.context(), len(streams["i_normal"])
    try:
        program = gl.program(vertex_shader=sources[0], fragment_shader=sources[1])
    except Exception as error:  # moderngl's own kind
        raise RuntimeError(str(error)) from error
    buffers = [
        (gl.buffer(np.ascontiguousarray(values, np.float32)), "3f", key)
        for key, values in {"i_position": positions(count), **streams}.items()
        if key in program  # what a function ignores, compilers leave out
    ]
    points = gl.vertex_array(program, buffers)
    for key in program:
        if key.endswith("Matrix"):
            program[key].write(np.eye(4, dtype=np.float32))
        elif key in uniforms:
            program[key].value = tuple(uniforms[key])
    picture = gl.framebuffer([gl.texture((_WIDTH, -(-count // _WIDTH)), 4, dtype="f4")])

    def draw() -> Weights:
        picture.use()
        points.render(gl.POINTS)
        data = picture.read(components=4, dtype="f4")
        return np.frombuffer(data, np.float32).reshape(-1, 4)[:count]

    return draw


def positions(count: int) -> Weights:
    """Where the centers of the first pixels of a picture are, in [-1, 1]; shape (count, 3)."""
    y, x = np.divmod(np.arange(count), _WIDTH)
    x, y = (2 * x + 1) / _WIDTH - 1.0, (2 * y + 1) / -(-count // _WIDTH) - 1.0
    return np.stack([x, y, np.zeros(count)], axis=1).astype(np.float32)


@functools.cache
def library() -> Any:
    """The definitions that come with MaterialX."""
    mx = require("MaterialX", "dev")
    document = mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), document)
    return document


def graph(
    files: Mapping[str, bytes],
    name: str,
    function: str,
    output: str,
    folder: Path,
    *,
    parameters: bool = False,
) -> tuple[Any, Any]:
    """A document with a graph `pairs` that gives `a` and `b` to the node of a function.

    Parameters
    ----------
    folder
        Where the files of the export are put; they have to stay until a shader is generated.
    parameters
        Whether `a` and `b` are parameters of the graph, and the frame is fixed; else they are
        colors of the geometry, and the frame is its own.

    Raises
    ------
    RuntimeError
        If the document is not valid.
    """
    mx = require("MaterialX", "dev")
    for each, content in files.items():
        (folder / each).write_bytes(content)
    document = mx.createDocument()
    document.setDataLibrary(library())
    mx.readFromXmlFile(document, str(folder / f"{name}.mtlx"))
    node, inputs, outputs = _NODES[function]
    pairs = document.addNodeGraph("pairs")
    called = pairs.addNode(
        f"{name}_{node}", "called", "multioutput" if len(outputs) > 1 else outputs[output]
    )
    for key, target in zip("ab", inputs, strict=True):
        place = called.addInput(target, "vector3")
        if parameters:
            pairs.addInput(key, "vector3").setValueString("0, 0, 1")
            place.setInterfaceName(key)
        else:
            color = pairs.addNode("geomcolor", f"{key}_color", "color3")
            color.setInputValue("index", "ab".index(key))
            vector = pairs.addNode("convert", f"{key}_vector", "vector3")
            vector.addInput("in", "color3").setConnectedNode(color)
            place.setConnectedNode(vector)
    if parameters:
        for key, vector in _FRAME.items():
            constant = pairs.addNode("constant", f"{key}_constant", "vector3")
            constant.setInputValue("value", mx.Vector3(*vector))
            called.addInput(key, "vector3").setConnectedNode(constant)
    element = pairs.addOutput("shown", outputs[output])
    element.setNodeName("called")
    if len(outputs) > 1:
        element.setOutputString(output)
    valid, message = document.validate()
    if not valid:
        raise RuntimeError(message)
    return document, element


def generated(generator: str, document: Any, element: Any, stages: tuple[str, ...]) -> list[str]:
    """Source of stages of the shader that shows an element of a document.

    Parameters
    ----------
    generator
        Like "GenGlsl.Essl": the module and the class, as MaterialX names them in part.
    """
    mx = require("MaterialX", "dev")
    module, name = generator.split(".")
    generators = require(f"MaterialX.PyMaterialX{module}", "dev")
    writer = getattr(generators, f"{name}ShaderGenerator").create()
    context = require("MaterialX.PyMaterialXGenShader", "dev").GenContext(writer)
    context.registerSourceCodeSearchPath(mx.getDefaultDataSearchPath())
    context.getOptions().hwSrgbEncodeOutput = False
    shader = writer.generate("pairs", element, context)
    return [shader.getSourceCode(stage) for stage in stages]
