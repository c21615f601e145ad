"""What runs an export: build it, run it, read back."""

from __future__ import annotations

import abc
import time
from collections.abc import Callable, Mapping, Sequence
from typing import ClassVar

import numpy as np

from nacre.array import Floats, Weights
from nacre.brdf import Brdf
from nacre.registry import Registry
from tests.oracles.materials import MATERIALS

FEW = "anisotropic", "physical", "ggx"
"""Materials for runners of text that another one runs with all."""

PARITY = 5e-4, 1e-3
"""Largest error of float32 against float64: this times |reference|, plus this."""


class Runner(abc.ABC):
    """A tool that executes the output of a target."""

    target: ClassVar[str]
    """Name of the target in :data:`nacre.targets.TARGETS`."""
    title: ClassVar[str]
    """The tool, as tables name it: "g++", "Chromium (WebGL2)"."""
    functions: ClassVar[tuple[str, ...]] = ("eval", "pdf", "sample")
    """What the target holds of these."""
    materials: ClassVar[Sequence[str]] = MATERIALS
    """Those that tests run."""

    @abc.abstractmethod
    def missing(self) -> str | None:
        """Name of what has to be installed before this runs; None where nothing is."""

    @abc.abstractmethod
    def run(
        self, files: Mapping[str, bytes], name: str, function: str, a: Weights, b: Weights
    ) -> Weights:
        """What a function of an export returns.

        Parameters
        ----------
        files, name
            Output of :meth:`nacre.targets.Target.files`, and the identifier it was given.
        function
            "eval" or "pdf" of (wi, wo), or "sample" of (wo, u).
        a, b
            Its arguments, float32 of shape (n, 3).

        Returns
        -------
        float32 of shape (n, 3), (n,), or (n, 4): the direction to the light and its density

        Raises
        ------
        RuntimeError
            If the output does not compile; with the words of the compiler.
        """

    def rate(self, files: Mapping[str, bytes], name: str, a: Weights, b: Weights) -> float:
        """Evaluations of `eval` a second, of arguments that are in place: the best of some."""
        return best_rate(lambda: self.run(files, name, "eval", a, b), len(a))


RUNNERS: Registry[type[Runner]] = Registry(
    "nacre.runners",
    "runner",
    {
        "webgl": "tests.oracles.runners.webgl:WebGl",
        "webgpu": "tests.oracles.runners.webgpu:WebGpu",
        "three-webgl": "tests.oracles.runners.three:ThreeWebGl",
        "three-webgpu": "tests.oracles.runners.three:ThreeWebGpu",
        "opengl": "tests.oracles.runners.opengl:OpenGlRunner",
        "vulkan": "tests.oracles.runners.vulkan:VulkanRunner",
        "brdf-explorer": "tests.oracles.runners.brdf_explorer:BrdfExplorerRunner",
        "c": "tests.oracles.runners.native:Gcc",
        "c++": "tests.oracles.runners.native:Gxx",
        "slang": "tests.oracles.runners.slang:Slang",
        "slang-cuda": "tests.oracles.runners.slang_cuda:SlangCuda",
        "slang-glsl": "tests.oracles.runners.slang_shaders:SlangGlsl",
        "slang-hlsl": "tests.oracles.runners.slang_shaders:SlangHlsl",
        "slang-wgsl": "tests.oracles.runners.slang_shaders:SlangWgsl",
        "onnxruntime": "tests.oracles.runners.onnx:OnnxRuntime",
        "pytorch": "tests.oracles.runners.torch:PyTorch",
        "materialx-glsl": "tests.oracles.runners.materialx:OpenGl",
        "materialx-osl": "tests.oracles.runners.materialx:Cycles",
        "osl": "tests.oracles.runners.osl:Cycles",
    },
    base=Runner,
)
"""Runners by name: one module each in :mod:`tests.oracles.runners`."""


def best_rate(call: Callable[[], object], count: int, rounds: int = 5) -> float:
    """How many of `count` a call does in a second, at best; the first call is not timed."""
    call()
    seconds = []
    for _ in range(rounds):
        start = time.perf_counter()
        call()
        seconds.append(time.perf_counter() - start)
    return count / min(seconds)


def reference(brdf: Brdf, function: str, wi: Weights, wo: Weights) -> Floats:
    """What NumPy says of "eval" or "pdf" in double precision, in the form of :meth:`Runner.run`."""
    compute = brdf.eval if function == "eval" else brdf.pdf
    found: Floats = compute(wi.astype(np.float64), wo.astype(np.float64))
    return found


def worst_error(found: Weights, expected: Floats) -> float:
    """Largest error as a multiple of the one that :data:`PARITY` allows; infinite where a number
    is none.
    """
    if found.shape != expected.shape or not np.isfinite(found).all():
        return float("inf")
    relative, absolute = PARITY
    bound = relative * np.abs(expected) + absolute
    return float((np.abs(found - expected) / bound).max())
