"""What runs an export of a texture: as :mod:`tests.oracles.runner`, with places besides pairs."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from typing import ClassVar

from nacre.array import Weights
from nacre.btf import Btf
from nacre.registry import Registry
from nacre.targets import TARGETS
from nacre.targets.textures import TextureAtlas
from nacre.targets.textures.target import TextureTarget
from tests.oracles.textures import Points, read_ktx2

FUNCTIONS: Mapping[str, tuple[str, int]] = {
    "eval": ("{name}_eval(c.xy, c.z, a, b)", 3),
    "pdf": ("{name}_pdf(c.xy, a, b)", 1),
    "sample": ("{name}_sample(c.xy, b, a)", 4),
    "parallax": ("{name}_parallax(c.xy, b)", 2),
}
"""Calls, and how many numbers they give. a: light, or random numbers; b: view; c: place, level."""

GLSL_MAIN = """
void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec3 a = texelFetch(points_a, pixel, 0).xyz;
    vec3 b = texelFetch(points_b, pixel, 0).xyz;
    vec3 c = texelFetch(points_c, pixel, 0).xyz;
    result = %s;
}
"""
"""A fragment shader in GLSL that writes an expression of the vectors of its pixel."""


class TextureRunner(abc.ABC):
    """A tool that executes the output of a target."""

    target: ClassVar[str]
    """Name of the target in :data:`nacre.targets.TARGETS`."""
    title: ClassVar[str]
    """The tool, as tables name it."""
    functions: ClassVar[tuple[str, ...]] = tuple(FUNCTIONS)
    """Those that the output has."""

    @abc.abstractmethod
    def missing(self) -> str | None:
        """Name of what has to be installed before this runs; None where nothing is."""

    @abc.abstractmethod
    def run(self, files: Mapping[str, bytes], name: str, function: str, points: Points) -> Weights:
        """What a function of an export returns, float32 of shape (n, k).

        Parameters
        ----------
        files, name
            Output of :meth:`nacre.targets.Target.files`, and the identifier it was given.
        function
            One of :data:`FUNCTIONS`; "sample" takes its random numbers in place of lights.

        Raises
        ------
        RuntimeError
            If the output does not compile; with the words of the compiler.
        """

    @abc.abstractmethod
    def rate(self, files: Mapping[str, bytes], name: str, points: Points) -> float:
        """Evaluations of `eval` a second, at best."""


TEXTURE_RUNNERS: Registry[type[TextureRunner]] = Registry(
    "nacre.texture_runners",
    "runner of textures",
    {
        "opengl": "tests.oracles.texture_runners.opengl:OpenGl",
        "vulkan": "tests.oracles.texture_runners.vulkan:Vulkan",
        "webgl": "tests.oracles.texture_runners.webgl:WebGl",
        "webgpu": "tests.oracles.texture_runners.webgpu:WebGpu",
        "three": "tests.oracles.texture_runners.three:ThreeWebGl",
        "slang": "tests.oracles.texture_runners.slang:SlangCpp",
        "onnx": "tests.oracles.texture_runners.onnx:OnnxRuntime",
    },
    base=TextureRunner,
)
"""Runners by name, one module each."""


def exported(target: str, texture: Btf, atlas: TextureAtlas, name: str) -> Mapping[str, bytes]:
    """Files of a texture whose atlas is there."""
    made = TARGETS[target]()
    assert isinstance(made, TextureTarget)
    return made.texture_files(texture, atlas, name)


def arrays(files: Mapping[str, bytes]) -> dict[str, Weights]:
    """Pixels of the files of arrays, by the names that shaders call them."""
    found = {}
    for path, content in files.items():
        if path.endswith(".ktx2"):
            found[path.removesuffix(".ktx2")] = read_ktx2(content)
    return found


def source(files: Mapping[str, bytes]) -> str:
    """The code: the one file that holds no array."""
    (text,) = (body.decode() for path, body in files.items() if not path.endswith(".ktx2"))
    return text


def call(name: str, function: str, vector: str) -> str:
    """An expression of four numbers, of a language's type of those."""
    text, count = FUNCTIONS[function]
    rest = ", 0.0" * (4 - count)
    return f"{vector}({text.format(name=name)}{rest})"
